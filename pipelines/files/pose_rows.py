"""Poses as they are read from text, one by one, and what can be wrong with each."""

import math
from collections.abc import Sequence

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.trajectory import Trajectory

_SHORTEST, _LONGEST = 0.5, 2.0
"""Of a quaternion that is meant as a rotation, whose length is 1 but for rounding; by judgement, so that
columns in another order are noticed."""


class PoseRows:
    """Collects the poses of a file. Raises UserError that names the line at fault."""

    def __init__(self, layout: str) -> None:
        """``layout`` is what a line should hold, for messages."""
        self._layout = layout
        self._stamps: list[int] = []
        self._poses: list[tuple[float, float, float]] = []

    def add(self, place: str, stamp: int, x: float, y: float, yaw: float) -> None:
        """A pose with its stamp in nanoseconds."""
        if self._stamps and stamp <= self._stamps[-1]:
            raise UserError(f"The time in {place} is not after the one before; sort the file by time.")
        self._stamps.append(stamp)
        self._poses.append((x, y, yaw))

    def yaw_of(self, place: str, quaternion: Sequence[float]) -> float:
        """Radians, of a quaternion x, y, z, w."""
        length = math.hypot(*quaternion)
        if not _SHORTEST <= length <= _LONGEST:
            raise UserError(
                f"The quaternion in {place} is {length:.3g} long instead of 1, so it is not a rotation; "
                f"the line should hold '{self._layout}'."
            )
        qx, qy, qz, qw = quaternion
        return math.atan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)

    def trajectory(self, path: object) -> Trajectory:
        """All of them. Raises UserError when there are none."""
        if not self._stamps:
            raise UserError(f"{path} holds no poses; it should hold lines '{self._layout}'.")
        return Trajectory(np.array(self._stamps, dtype=np.int64), np.array(self._poses))
