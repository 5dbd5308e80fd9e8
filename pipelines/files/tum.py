"""Trajectories as TUM files: ``t x y z qx qy qz qw`` per line, seconds and metres."""

import math
from pathlib import Path

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.number_lines import read_number_lines

_LAYOUT = "t x y z qx qy qz qw"
_SHORTEST, _LONGEST = 0.5, 2.0
"""Of a quaternion that is meant as a rotation, whose length is 1 but for rounding; by judgement, so that
columns in another order are noticed."""


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
    stamps: list[int] = []
    rows: list[list[float]] = []
    for line in read_number_lines(path, _LAYOUT, stamps=1):
        if stamps and line.stamps[0] <= stamps[-1]:
            raise UserError(f"The time in {line.place} is not after the one before; sort the file by time.")
        length = math.hypot(*line.numbers[3:])
        if not _SHORTEST <= length <= _LONGEST:
            raise UserError(
                f"The quaternion in {line.place} is {length:.3g} long instead of 1, so it is not a rotation; "
                f"the line should hold '{_LAYOUT}'."
            )
        stamps += line.stamps
        rows.append(line.numbers)
    if not stamps:
        raise UserError(f"{path} holds no poses; it should hold lines '{_LAYOUT}'.")
    x, y, _, qx, qy, qz, qw = np.array(rows).T
    yaw = np.arctan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)
    return Trajectory(np.array(stamps, dtype=np.int64), np.column_stack([x, y, yaw]))
