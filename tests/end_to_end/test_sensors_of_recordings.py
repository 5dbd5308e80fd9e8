"""What recordings of strangers' robots prove about their sensors."""

from pathlib import Path

import numpy as np
import pytest

from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.run_context import RunContext

pytestmark = pytest.mark.slow

REVERSED = {
    "turtlebot4_rplidar",
    "mower_rplidar",
    "mower_rplidar_unknown_mount",
    "handheld_rplidar_room",
    "handheld_rplidar_corridor",
}
UNKNOWN_MOUNT = {"mower_rplidar", "mower_rplidar_unknown_mount"}


def bags_of(folder: Path) -> dict[str, Path]:
    """The recordings in the folders of a folder, which may lie beside maps and tables."""
    bags = {}
    for child in sorted(each for each in folder.iterdir() if each.is_dir()):
        files = [file for file in child.iterdir() if file.suffix in (".bag", ".db3", ".mcap")]
        if files:
            bags[child.name] = files[0] if len(files) == 1 else child
    return bags


def test_each_recording_is_read_as_it_was_measured(recordings: Path) -> None:
    bags = bags_of(recordings / "strangers") | bags_of(recordings / "cartographer_runs")
    logs = recordings / "slam_benchmark"
    bags |= {"intel": logs / "intel.bag", "fr079": logs / "fr079", "aces": logs / "aces"}
    bags["session_A"] = recordings / "racecar" / "session_A"
    found = {}
    for name, bag in bags.items():
        with BagReader(bag) as reader:
            calibrate(reader, RunContext())
            found[name] = (dict(reader.inputs.get("corrections", {})), reader)  # type: ignore[call-overload]
    assert set(bags) >= REVERSED | UNKNOWN_MOUNT
    assert {name for name, (made, _) in found.items() if made.get("beams") == "reversed"} == REVERSED
    assert {name for name, (made, _) in found.items() if made.keys() - {"beams"}} == set()
    mounts = {
        name: reader for name, (_, reader) in found.items() if reader.base_from_laser_source == "motion"
    }
    assert set(mounts) == UNKNOWN_MOUNT
    assert all(abs(abs(reader.base_from_laser[2]) - np.pi) < 0.05 for reader in mounts.values())
