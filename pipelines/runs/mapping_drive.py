"""The drive that made a map, and whether a bag is its recording."""

from os.path import realpath
from pathlib import Path
from typing import Any

from racecar.maps.map_files import find_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.fingerprint import bag_fingerprint
from racecar.pipelines.files.report import read_report
from racecar.pipelines.files.tum import load_tum


def has_mapping_drive(map_path: Path) -> bool:
    """Whether the poses of the drive that made a map lie beside it."""
    return _trajectory_file(map_path).is_file()


def mapping_trajectory(map_path: Path, bag: Path) -> Trajectory | None:
    """Where a bag's car was when it made a map; None for a map without a trajectory, or of another bag.

    The report beside the map names the bag. Stamps are not asked: clocks that were never set, and simulated
    ones, count the same times on every drive.
    """
    if not has_mapping_drive(map_path) or not _is_named(bag, _inputs(map_path)):
        return None
    return load_tum(_trajectory_file(map_path))


def _trajectory_file(map_path: Path) -> Path:
    return find_map(map_path).parent / "trajectory.tum"


def _inputs(map_path: Path) -> dict[str, Any]:
    """What the map's report says it was made from; nothing where there is none, or it is damaged."""
    inputs = read_report(find_map(map_path).parent).get("inputs")
    return inputs if isinstance(inputs, dict) else {}


def _is_named(bag: Path, inputs: dict[str, Any]) -> bool:
    """By its content; where a report does not hold that, by its path."""
    if "bag_fingerprint" in inputs:
        return bool(inputs["bag_fingerprint"] == bag_fingerprint(bag))
    named = inputs.get("bag")
    return isinstance(named, str) and "\0" not in named and realpath(named) == realpath(bag)
