"""The drive that made a map, and whether a bag is its recording."""

from pathlib import Path

from racecar.maps.map_files import find_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.tum import load_tum


def has_mapping_drive(map_path: Path) -> bool:
    """Whether the trajectory of the drive that made a map is beside it."""
    return _trajectory_file(map_path).is_file()


def mapping_path(map_path: Path) -> Trajectory | None:
    """The trajectory of the drive that made a map, of any bag. Raises UserError when it cannot be read."""
    return load_tum(_trajectory_file(map_path)) if has_mapping_drive(map_path) else None


def _trajectory_file(map_path: Path) -> Path:
    return find_map(map_path).parent / "trajectory.tum"


def mapping_trajectory(map_path: Path, bag: Path) -> Trajectory | None:
    """The trajectory of the drive that made a map, if it was this bag's; None without one or for another bag.

    The report beside the map identifies the bag by its content, or else by its path. Stamps are not compared:
    clocks that were never set, and simulated clocks, repeat the same times on every drive.
    """
    inputs = read_report(find_map(map_path).parent).inputs
    if inputs.bag_fingerprint is None:
        is_own = inputs.is_at_path_of(bag)
    else:
        is_own = inputs.bag_fingerprint == bag_fingerprint(bag)
    return mapping_path(map_path) if is_own else None
