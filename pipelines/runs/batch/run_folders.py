"""Choose a folder for each bag's map: none replaces another's, and a repeated batch finds its own."""

from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.runs.batch.bag_search import bag_stem
from racecar.pipelines.runs.map_outputs import MAP_NAMES
from racecar.pipelines.runs.output_places import is_free

_LONGEST_NAME = 120
"""Characters. File systems allow 255 bytes, and many letters take two."""


def run_folders(bags: Sequence[Path], out: Path, reserved: Sequence[str] = ()) -> list[Path]:
    """A folder in ``out`` for each bag, named after it. Bags with the same name are distinguished by their
    parent folders, or else by numbers.

    A folder with the run of one of these bags remains that bag's. Folders with the run of another bag, with a
    bag or with foreign files are not used, nor are ``reserved`` names.
    """
    owners = {path.name: _Owner(path) for path in out.iterdir() if path.is_dir()} if out.is_dir() else {}
    folders: dict[Path, str] = {}
    taken = {name.casefold() for name in reserved}
    for is_own in (_Owner.has_content_of, _Owner.is_at_path_of):
        for bag in bags:
            own = [] if bag in folders else [name for name, owner in owners.items() if is_own(owner, bag)]
            name = next((name for name in sorted(own, key=len) if name.casefold() not in taken), None)
            if name is not None:
                folders[bag] = name
                taken.add(name.casefold())
    taken |= {name.casefold() for name in owners if not is_free(out / name, lambda: MAP_NAMES)}
    for bag in bags:
        if bag not in folders:
            folders[bag] = next(name for name in _names(bag) if name.casefold() not in taken)
            taken.add(folders[bag].casefold())
    return [out / folders[bag] for bag in bags]


class _Owner:
    """The bag whose run is in a folder."""

    def __init__(self, folder: Path) -> None:
        self._inputs = read_report(folder).inputs

    def has_content_of(self, bag: Path) -> bool:
        """Whether the bag has the same content, even if it was moved."""
        try:
            return self._inputs.bag_fingerprint == bag_fingerprint(bag)
        except (UserError, OSError):
            return False

    def is_at_path_of(self, bag: Path) -> bool:
        """Whether the bag has the same path, even if its content changed."""
        return self._inputs.is_at_path_of(bag)


def _names(bag: Path) -> Iterator[str]:
    """Yield drive, then monday-drive, week-monday-drive, and so on, then drive-2, drive-3, without end."""
    stem = bag_stem(bag)[:_LONGEST_NAME]
    yield stem
    name = stem
    for folder in bag.parents:
        name = f"{folder.name}-{name}"
        if not folder.name or len(name) > _LONGEST_NAME:
            break
        yield name
    for number in count(2):
        yield f"{stem}-{number}"
