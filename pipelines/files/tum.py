"""Trajectories as TUM files: ``t x y z qx qy qz qw`` per line, seconds and metres."""

from pathlib import Path

import numpy as np

from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.number_lines import read_number_lines
from racecar.pipelines.files.pose_rows import PoseRows

_LAYOUT = "t x y z qx qy qz qw"


def save_tum(trajectory: Trajectory, path: Path) -> None:
    """Write poses as TUM; stamps keep every nanosecond.

    Raises UserError when the place cannot be written to.
    """
    with write_atomically(path) as partial, partial.open("w", encoding="ascii") as file:
        for stamp, (x, y, yaw) in zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True):
            seconds, nanoseconds = divmod(stamp, 10**9)
            qz, qw = np.sin(yaw / 2), np.cos(yaw / 2)
            file.write(f"{seconds}.{nanoseconds:09d} {x:.9f} {y:.9f} 0 0 0 {qz:.12f} {qw:.12f}\n")


def load_tum(path: Path) -> Trajectory:
    """Read a TUM file; of poses in space, x, y and the yaw are taken.

    Raises UserError that names the line when the file is not a TUM trajectory in ascending time.
    """
    rows = PoseRows(_LAYOUT)
    for line in read_number_lines(path, _LAYOUT, stamps=1):
        x, y, _, *quaternion = line.numbers
        rows.add(line.place, line.stamps[0], x, y, rows.yaw_of(line.place, quaternion))
    return rows.trajectory(path)
