"""Trajectories as TUM files: ``t x y z qx qy qz qw`` per line, seconds and metres."""

from pathlib import Path

import numpy as np

from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.table import Row, StampedPose, columns_of, read_rows, trajectory_of

_LAYOUT = "t x y z qx qy qz qw"


def save_tum(trajectory: Trajectory, path: Path) -> None:
    """Write poses as TUM; stamps are exact to the nanosecond.

    Raises UserError when the file cannot be written.
    """
    with write_atomically(path) as partial, partial.open("w", encoding="ascii") as file:
        for stamp, (x, y, yaw) in zip(trajectory.stamps.tolist(), trajectory.map_from_base, strict=True):
            seconds, nanoseconds = divmod(stamp, 10**9)
            qz, qw = np.sin(yaw / 2), np.cos(yaw / 2)
            file.write(f"{seconds}.{nanoseconds:09d} {x:.9f} {y:.9f} 0 0 0 {qz:.12f} {qw:.12f}\n")


def load_tum(path: Path) -> Trajectory:
    """Read a TUM file; of 3D poses, only x, y and yaw are used.

    Raises UserError that names the line when the file is not a TUM trajectory in ascending time.
    """
    return trajectory_of(map(_pose, read_rows(path, _LAYOUT)), path, _LAYOUT)


def _pose(row: Row) -> StampedPose:
    time, x, y, z, *quaternion = columns_of(_LAYOUT)
    row.number(z)  # unused, but should be a number
    return StampedPose(row, row.stamp(time), row.number(x), row.number(y), row.yaw(quaternion))
