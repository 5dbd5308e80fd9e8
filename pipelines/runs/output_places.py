"""Where a run may write: never over its inputs, never over or into a recording, and over a file that it did
not write only with ``force``.

Our files are marked as ours (`author_of`, `is_our_recording`), so that a command can be repeated.
"""

import errno
import os
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import permutations
from os.path import realpath
from pathlib import Path
from typing import Protocol

from PIL import Image

from racecar.maps.errors import UserError
from racecar.maps.whole_files import cannot_write, is_stream
from racecar.maps.whole_folders import finish_replacing
from racecar.pipelines.bags.storage.folder import METADATA
from racecar.pipelines.bags.storage.recordings import (
    is_bag_file,
    is_bag_folder,
    is_our_recording,
    refuse_lone_part,
)
from racecar.pipelines.files.run_report import REPORT_FILE

_COMMAND = re.compile(rb'\{\s*"command": "(racecar[^"]*)"')
_FIRST_BYTES = 200
"""Read from a JSON file; the longest name of a command takes fewer."""


class ForeignFileError(UserError):
    """A file that is not ours would be replaced, which ``force`` permits."""


class OutputPlace(Protocol):
    """A path that a run writes to."""

    @property
    def path(self) -> Path:
        """The path as the user gave it."""

    def holds(self, path: Path) -> bool:
        """Whether writing here replaces what is at a path."""

    def check(self, inputs: Sequence[Path], *, force: bool) -> None:
        """Raises UserError when something would be lost, or nothing can be written there."""


@dataclass(frozen=True)
class OutputFile:
    """A single file."""

    path: Path
    author: str
    """The command that writes the file, and may replace its own earlier output."""
    suffix: str = ""
    """Required suffix of the name."""

    def holds(self, path: Path) -> bool:
        """Whether the path is this file, or would be below it."""
        return _is_within(path, self.path)

    def check(self, inputs: Sequence[Path], *, force: bool) -> None:
        """Raises UserError when something would be lost, or nothing can be written there."""
        if is_stream(self.path):
            return
        if not self.path.name.lower().endswith(self.suffix):
            raise UserError(f"{self.path} is written as {self.suffix}: name a file that ends so.")
        _check_way_to(self.path, is_folder=False)
        _refuse_recording(self.path, inputs)
        for each in inputs:
            if _is_same(self.path, each):
                raise _is_read(self.path)
        if self.path.exists() and not _is_by(self.author, self.path):
            self._refuse_foreign(inputs, force=force)

    def _refuse_foreign(self, inputs: Sequence[Path], *, force: bool) -> None:
        if any(_is_within(self.path, each) for each in [*inputs, *_images_of(inputs)]):
            raise _is_read(self.path)
        if not force:
            raise ForeignFileError(f"{self.path} was not written by `{self.author}`: name another file.")


@dataclass(frozen=True)
class OutputFolder:
    """A folder for results; other files in it are kept."""

    path: Path
    names: Callable[[], Collection[str]]
    """Names of the files and folders written into it."""
    remade: tuple[Path, ...] = ()
    """Input folders that may be replaced by the results made from them."""

    def holds(self, path: Path) -> bool:
        """Whether the path is this folder, one of its parents, or one of the results."""
        return _is_same(path, self.path) or (
            _is_within(path, self.path) and any(_is_within(path, self.path / name) for name in self.names())
        )

    def check(self, inputs: Sequence[Path], *, force: bool) -> None:
        """Raises UserError when something would be lost, or nothing can be written there."""
        _check_way_to(self.path, is_folder=True)
        _refuse_recording(self.path, inputs)
        is_remade = any(_is_same(self.path, each) for each in self.remade)
        for each in inputs:
            if self.holds(each) and not (is_remade and _recording_at(each) is None):
                raise _is_read(each)
        if not is_remade:
            _refuse_foreign_results(self.path, self.names, force=force)


@dataclass(frozen=True)
class OutputBag:
    """A bag and the files beside it that belong to it."""

    path: Path
    author: str
    beside: tuple[Path, ...] = ()

    def holds(self, path: Path) -> bool:
        """Whether the path is the bag, is inside it, or is one of the files beside it."""
        return any(_is_within(path, each) for each in (self.path, *self.beside))

    def check(self, inputs: Sequence[Path], *, force: bool) -> None:
        """Raises UserError when something would be lost, or nothing can be written there."""
        refuse_lone_part(self.path)
        is_folder = self.path.suffix != ".bag"
        _check_way_to(self.path, is_folder=is_folder)
        for each in inputs:
            if self.holds(each):
                raise _is_read(each)
        if is_our_recording(self.path):
            _refuse_recording(self.path.absolute().parent, inputs)
            return
        _refuse_recording(self.path, inputs)
        if is_folder:
            names = (METADATA, f"{self.path.absolute().name}.mcap")
            _refuse_foreign_results(self.path, lambda: names, force=force)
        for file in self.beside:
            OutputFile(file, self.author).check(inputs, force=force)


def check_places(places: Sequence[OutputPlace], read: Sequence[Path], *, force: bool) -> None:
    """Raises UserError, in one sentence, when a run with these outputs and input paths would lose something
    or could not write."""
    for path in (*read, *(place.path for place in places)):
        finish_replacing(path)
    inputs = list(_meant_by(read))
    try:
        for place in places:
            place.check(inputs, force=force)
        for one, other in permutations(places, 2):
            if one.holds(other.path):
                raise UserError(
                    f"{other.path} would be written twice, as {one.path} is written to as well: name another "
                    "place for one of them."
                )
    except OSError as error:  # for example a name that is too long
        raise cannot_write(Path(error.filename or places[0].path), error) from error


def _refuse_foreign_results(folder: Path, names: Callable[[], Collection[str]], *, force: bool) -> None:
    """Raises UserError when a folder holds files of these names, none of them ours."""
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    there = [folder / name for name in sorted(names()) if (folder / name).exists()]
    if any(author_of(path) for path in there):
        return
    for path in there:
        _refuse_recording(path, ())
        if not force:
            raise ForeignFileError(f"{path} was not written by racecar: name another folder.")


def _meant_by(read: Sequence[Path]) -> Iterator[Path]:
    """The existing files and folders that are read when these paths are given."""
    for named in read:
        bag, colon, _ = str(named).rpartition(":")  # and a topic
        path = Path(bag) if colon and not _is_there(named) else named
        if not _is_there(path):
            continue  # a shipped map, or a mistake that is reported when it is read
        yield path
        folder = path.parent if path.name == "map.yaml" else path
        if folder.is_dir():
            yield folder
            yield folder / REPORT_FILE


def _images_of(inputs: Sequence[Path]) -> Iterator[Path]:
    from racecar.maps.map_files import image_of_map

    for each in inputs:
        if each.suffix in (".yaml", ".yml"):
            with suppress(UserError):
                yield image_of_map(each)


def _is_by(author: str, path: Path) -> bool:
    written_by = author_of(path)
    return written_by is not None and f"{written_by} ".startswith(f"{author} ")


def _check_way_to(path: Path, *, is_folder: bool) -> None:
    if path.exists() and path.is_dir() != is_folder:
        raise UserError(
            f"{path} is a file; name a folder to write to."
            if is_folder
            else f"{path} is a folder; name a file to write to."
        )
    real = Path(realpath(path))
    first = real if is_folder else real.parent
    home = next(each for each in (first, *first.parents) if each.exists())
    if not home.is_dir():
        raise UserError(f"{path} cannot be written, as {home} is a file: name another place.")
    if not os.access(home, os.W_OK | os.X_OK):
        raise cannot_write(path, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))


def _refuse_recording(path: Path, inputs: Sequence[Path]) -> None:
    read = (each for each in inputs if is_bag_folder(each) and _is_within(path, each))
    recording = _recording_at(path) or next(read, None)
    if recording is None:
        return
    if _is_same(path, recording):
        raise UserError(f"{path} is a recording, and none is ever replaced: name another place.")
    raise UserError(f"{path} lies in the recording {recording}: name a place outside it.")


def _recording_at(path: Path) -> Path | None:
    """The recording that a path leads to or into, or None."""
    real = Path(realpath(path))
    if is_bag_file(real):
        return path
    folders = ((real, path), (real.parent, real.parent))
    return next(
        (named for each, named in folders if (each / METADATA).is_file() and is_bag_folder(each)), None
    )


def _is_read(path: Path) -> UserError:
    return UserError(f"{path} is read by this run and would be replaced: name another place for the output.")


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # for example a name that is too long
        return False


def _is_within(path: Path, folder: Path) -> bool:
    """Whether a path is a file or folder, or is inside it, through whatever links and names."""
    real = Path(realpath(path))
    return any(_is_same(each, folder) for each in (real, *real.parents))


def _is_same(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # does not exist yet
        return realpath(one) == realpath(other)


def author_of(path: Path) -> str | None:
    """A command such as "racecar map"; None if another program wrote the file, or it cannot be read."""
    with suppress(OSError), path.open("rb") as file:
        found = _COMMAND.match(file.read(_FIRST_BYTES))
        return _author_of_picture(path) if found is None else found[1].decode(errors="replace")
    return None


def _author_of_picture(path: Path) -> str | None:
    try:
        with Image.open(path, formats=["PNG"]) as picture:
            author = picture.info.get("Software")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return author if isinstance(author, str) and author.startswith("racecar") else None
