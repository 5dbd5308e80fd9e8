"""Where a run may write: never over its inputs, never over or into a recording, and only with ``replace``
over the results of an earlier run or over a file that racecar did not write.

A single file or bag that the same command wrote (`author_of`, `is_our_recording`) is replaced unasked. So are
the results that a run reads and makes again in their folder, unless another program changed them.
"""

import errno
import os
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count, permutations
from os.path import realpath
from pathlib import Path
from typing import Protocol

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
from racecar.pipelines.files.authorship import author_of
from racecar.pipelines.files.filter_masks import FILTERS, filter_files
from racecar.pipelines.files.run_report import REPORT_FILE, read_report
from racecar.pipelines.files.written_files import not_as_written


class OccupiedError(UserError):
    """Something that is there would be replaced, which ``replace`` permits."""

    def or_else(self, remedy: str) -> UserError:
        """The error with another remedy, for whoever can permit it."""
        return UserError(f"{str(self)[:-1]}, or {remedy}.")


class OutputPlace(Protocol):
    """A path that a run writes to."""

    @property
    def path(self) -> Path:
        """The path as the user gave it."""

    def holds(self, path: Path) -> bool:
        """Whether writing here replaces what is at a path."""

    def check(self, inputs: Sequence[Path], *, replace: bool) -> None:
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

    def check(self, inputs: Sequence[Path], *, replace: bool) -> None:
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
            self._refuse_foreign(inputs, replace=replace)

    def _refuse_foreign(self, inputs: Sequence[Path], *, replace: bool) -> None:
        if any(_is_within(self.path, each) for each in [*inputs, *_images_of(inputs)]):
            raise _is_read(self.path)
        if not replace:
            raise OccupiedError(f"{self.path} was not written by `{self.author}`: name another file.")


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

    def check(self, inputs: Sequence[Path], *, replace: bool) -> None:
        """Raises UserError when something would be lost, or nothing can be written there."""
        _check_way_to(self.path, is_folder=True)
        _refuse_recording(self.path, inputs)
        is_remade = any(_is_same(self.path, each) for each in self.remade)
        for each in inputs:
            if self.holds(each) and not (is_remade and _recording_at(each) is None):
                raise _is_read(each)
        if self.path.is_dir() and any(self.path.iterdir()):
            _check_results(self.path, self.names(), is_remade=is_remade, replace=replace)


@dataclass(frozen=True)
class OutputBag:
    """A bag and the files beside it that belong to it."""

    path: Path
    author: str
    beside: tuple[Path, ...] = ()

    def holds(self, path: Path) -> bool:
        """Whether the path is the bag, is inside it, or is one of the files beside it."""
        return any(_is_within(path, each) for each in (self.path, *self.beside))

    def check(self, inputs: Sequence[Path], *, replace: bool) -> None:
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
            _check_results(self.path, names, is_remade=False, replace=replace)
        for file in self.beside:
            OutputFile(file, self.author).check(inputs, replace=replace)


def check_places(places: Sequence[OutputPlace], read: Sequence[Path], *, replace: bool) -> None:
    """Raises UserError, in one sentence, when a run with these outputs and input paths would lose something
    or could not write."""
    for path in (*read, *(place.path for place in places)):
        finish_replacing(path)
    inputs = list(_meant_by(read))
    try:
        for place in places:
            place.check(inputs, replace=replace)
        for one, other in permutations(places, 2):
            if one.holds(other.path):
                raise UserError(
                    f"{other.path} would be written twice, as {one.path} is written to as well: name another "
                    "place for one of them."
                )
    except OSError as error:  # for example a name that is too long
        raise cannot_write(Path(error.filename or places[0].path), error) from error


def check_saving(place: OutputPlace, *, replace: bool) -> None:
    """The same for the result of a call in Python."""
    try:
        check_places([place], (), replace=replace)
    except OccupiedError as error:
        raise error.or_else("pass replace=True") from error


def free_folder(path: Path, names: Callable[[], Collection[str]]) -> Path:
    """The first of folder, folder-2, folder-3 and so on where results of these names replace nothing."""
    beside = (path.with_name(f"{path.name}-{number}") for number in count(2))
    return next(folder for folder in chain([path], beside) if is_free(folder, names))


def is_free(path: Path, names: Callable[[], Collection[str]]) -> bool:
    """Whether results of these names would replace nothing in a folder."""
    try:
        check_places([OutputFolder(path, names)], (), replace=False)
    except UserError:
        return False
    return not is_bag_folder(path)


def _check_results(folder: Path, names: Collection[str], *, is_remade: bool, replace: bool) -> None:
    """Raises UserError when a folder holds a recording, and OccupiedError when it holds results, of these
    names."""
    there = [path for name in sorted(names) if (path := folder / name).exists()]
    for path in there:
        if not is_our_recording(path):
            _refuse_recording(path, ())
    if replace or not there:
        return
    foreign = not_as_written(folder, names)
    lost = [f"{path.relative_to(folder)} (by another program)" for path in foreign]
    if not is_remade and (ours := [path.name for path in there if path not in foreign]):
        lost = [*_described(folder, ours), *lost]
    if lost:
        raise OccupiedError(f"{folder} holds {_listed(lost)}, which would be replaced: name another folder.")


def _described(folder: Path, names: Sequence[str]) -> list[str]:
    """Results of ours in a folder: the run, and the masks that come from its edits; or else the files."""
    command = author_of(folder / REPORT_FILE) if REPORT_FILE in names else None
    if command is None:
        return list(names)
    bag = read_report(folder).inputs.bag
    of = f" for {Path(bag).name}" if bag else ""
    masks = [f"its {kind} mask" for kind in FILTERS if filter_files(kind)[1] in names]
    return [f"the results of `{command}`{of}", *masks]


def _listed(things: Sequence[str]) -> str:
    *others, last = things
    return f"{', '.join(others)} and {last}" if others else last


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
