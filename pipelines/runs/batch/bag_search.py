"""Find the bags of a batch: those named in a list, or those in a folder."""

import os
from collections.abc import Iterator
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.pipelines.bags.storage.folder import natural_order, unpacked_name
from racecar.pipelines.bags.storage.recordings import (
    BAG_SUFFIXES,
    is_bag_file,
    is_bag_folder,
)
from racecar.pipelines.files.run_report import REPORT_FILE
from racecar.pipelines.files.typed_path import typed_path

_MOST_BYTES = 10_000_000
"""Maximum of a list: 100 000 long paths take less, and a bag given by mistake is not read whole."""


def find_bags(source: Path, out: Path) -> list[Path]:
    """The bags, as absolute paths, each once.

    A folder is searched recursively except for ``out``, whose bags are recordings of runs. A list holds one
    path per line, of a bag or of a folder to search; blank lines and lines that start with # are skipped.
    Relative paths start at the list's folder, or else at the current one. Raises UserError when there are no
    bags, or when the list cannot be read.
    """
    if source.is_dir():
        found = list(_search(source, _Visited(out)))
        if not found:
            raise UserError(f"There is no bag in {source}, nor in the folders below it.")
    elif is_bag_file(source):
        found = [source]
    else:
        found = list(_listed(source, out))
        if not found:
            raise UserError(f"{source} lists no bags: write the path of one on each line.")
    bags: dict[str, Path] = {}
    for bag in found:
        bags.setdefault(os.path.realpath(bag), bag.absolute())
    return list(bags.values())


def bag_stem(bag: Path) -> str:
    """The name of a bag without its suffix."""
    name = unpacked_name(bag)
    return next((name.removesuffix(suffix) for suffix in BAG_SUFFIXES if name.endswith(suffix)), name) or name


class _Visited:
    """Folders that are not searched: already visited through a link, or excluded."""

    def __init__(self, out: Path) -> None:
        self._folders = {os.path.realpath(out)}

    def is_new(self, folder: Path) -> bool:
        place = os.path.realpath(folder)
        is_new = place not in self._folders
        self._folders.add(place)
        return is_new


def _listed(source: Path, out: Path) -> Iterator[Path]:
    visited = _Visited(out)
    for line in read_text(source, _MOST_BYTES).removeprefix("\ufeff").splitlines():
        words = line.strip()
        if not words or words.startswith("#"):
            continue
        if "\0" in words:
            raise UserError(f"{source} is not a list of bags: write the path of one on each line.")
        named = typed_path(words)
        beside = source.parent / named
        path = named if named.exists() and not beside.exists() else beside
        if path.is_dir() and not is_bag_folder(path):
            found = list(_search(path, visited))
            yield from found or [path]  # its row will report that there is no bag
        else:
            yield path


def _search(folder: Path, visited: _Visited) -> Iterator[Path]:
    """Contents of a folder, sorted by name. Raises UserError when it cannot be read."""
    if not visited.is_new(folder):
        return
    if is_bag_folder(folder):
        yield folder
        return
    try:
        entries = sorted(folder.iterdir(), key=natural_order)
    except OSError as error:
        raise UserError(f"{folder} cannot be read: {error.strerror}.") from error
    is_run = (folder / REPORT_FILE).is_file()
    for entry in entries:
        if entry.name.startswith(".") or (is_run and entry.name == "record"):
            continue
        if entry.is_dir():
            yield from _search(entry, visited)
        elif is_bag_file(entry):
            yield entry
