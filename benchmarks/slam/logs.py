"""The locations of the SLAM benchmark's logs: bags, each with its true relations beside it."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from racecar.maps.errors import UserError

_SUBFOLDER = "slam_benchmark"
_BAG_ENDINGS = (".bag", "", ".mcap", ".db3")


@dataclass(frozen=True)
class BenchmarkLog:
    """A bag and the true relations of its poses."""

    name: str
    bag: Path
    relations: Path


def find_logs(folder: Path, names: Collection[str] = ()) -> list[BenchmarkLog]:
    """The logs in a folder, or in its ``slam_benchmark``, by name; only those named, if any.

    Raises UserError if there are none, or one of those named is missing.
    """
    home = folder / _SUBFOLDER if (folder / _SUBFOLDER).is_dir() else folder
    logs = {path.stem: _log_of(path) for path in sorted(home.glob("*.relations"))}
    found = {name: log for name, log in logs.items() if log is not None}
    if not found:
        raise UserError(
            f"There is no benchmark log in {home}: a bag with a .relations file of the same name; "
            "name their folder with --data."
        )
    for name in names:
        if name not in found:
            raise UserError(f"There is no log '{name}' in {home}; there are: {', '.join(found)}.")
    return [log for name, log in found.items() if not names or name in names]


def _log_of(relations: Path) -> BenchmarkLog | None:
    for ending in _BAG_ENDINGS:
        bag = relations.with_name(relations.stem + ending)
        if bag.exists():
            return BenchmarkLog(relations.stem, bag, relations)
    return None
