"""The path driven, in memory that does not grow with the drive."""

import numpy as np

from racecar.maps.geometry.se2 import Pose

_SPACING = 0.05
"""Metres between poses: finer than a line is drawn, by judgement."""
_MOST = 4000
"""Poses, as a message of them is published every second: by judgement."""


class DrivenPath:
    """Poses a little apart; when they become too many, every other one is dropped."""

    def __init__(self) -> None:
        self._poses = np.zeros((_MOST, 3))
        self._count = 0
        self._spacing = _SPACING

    def add(self, pose: Pose) -> None:
        """Continue to a pose (3,)."""
        if self._count and np.hypot(*(pose - self._poses[self._count - 1])[:2]) < self._spacing:
            return
        if self._count == _MOST:
            kept = self._poses[::2].copy()
            self._count, self._spacing = len(kept), 2 * self._spacing
            self._poses[: self._count] = kept
        self._poses[self._count] = pose
        self._count += 1

    @property
    def poses(self) -> Pose:
        """(N, 3), a copy."""
        return self._poses[: self._count].copy()
