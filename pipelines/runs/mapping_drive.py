"""The drive that made a map, and whether a bag is its recording."""

from pathlib import Path

from racecar.maps.map_files import find_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.tum import load_tum


def has_mapping_drive(map_path: Path) -> bool:
    """Whether the poses of the drive that made a map lie beside it."""
    return _trajectory_file(map_path).is_file()


def mapping_path(map_path: Path) -> Trajectory | None:
    """Where the car was when it made a map, of whatever bag. Raises UserError when that cannot be read."""
    return load_tum(_trajectory_file(map_path)) if has_mapping_drive(map_path) else None


def _trajectory_file(map_path: Path) -> Path:
    return find_map(map_path).parent / "trajectory.tum"


def mapping_trajectory(map_path: Path, bag: Path) -> Trajectory | None:
    """Where a bag's car was when it made a map; None for a map without a trajectory, or of another bag.

    The report beside the map names the bag, by its content; where it does not hold that, by its path. Stamps
    are not asked: clocks that were never set, and simulated ones, count the same times on every drive.
    """
    inputs = read_report(find_map(map_path).parent).inputs
    if inputs.bag_fingerprint is None:
        is_own = inputs.is_at_path_of(bag)
    else:
        is_own = inputs.bag_fingerprint == bag_fingerprint(bag)
    return mapping_path(map_path) if is_own else None
