"""Detects odometry that repeats one pose while the car moves, and ignores it for that time.

A driver that hangs, or a wheel board that lost its bus, repeats its last message, as if the car stood. A
standing car looks the same; only scans can distinguish the two. When a robot is carried its wheels stand
while it moves, and nothing distinguishes that from a driver that hangs.
"""

from dataclasses import dataclass, replace

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.odometry import Odometry

_TOLD_FROM = 0.5
"""Metres or radians of motion meanwhile above which the user is warned. Less results from stamps that lag by
some tenths of a second while a car brakes. Chosen by judgement."""


@dataclass(frozen=True)
class FrozenStretch:
    """One period in which odometry repeated a pose."""

    begin: int
    """Nanoseconds of the first sample with that pose."""
    end: int
    """Nanoseconds of the first sample with another pose, or of the last scan until there is one."""
    moved: float
    """Metres plus radians of motion in the scans meanwhile."""


class FrozenOdometry:
    """Whether odometry is frozen now, and when it was."""

    def __init__(self) -> None:
        self._pose: Pose | None = None
        self._stretches: list[FrozenStretch] = []

    def copy(self) -> "FrozenOdometry":
        """A copy of the current state."""
        other = FrozenOdometry()
        other._pose, other._stretches = self._pose, list(self._stretches)
        return other

    def is_frozen_at(self, stamp: int) -> bool:
        """Whether its poses are invalid at a stamp (nanoseconds) after the last freeze began."""
        return self._pose is not None or (bool(self._stretches) and stamp < self._stretches[-1].end)

    def freeze(self, begin: int, odom_from_base: Pose) -> None:
        """Mark the pose (3,) that it repeats since a stamp in nanoseconds as contradicted by scans; NaN in
        components that may change while the rest stays frozen."""
        self._pose = odom_from_base
        self._stretches.append(FrozenStretch(begin, begin, 0.0))

    def thaws_with(self, odometry: Odometry) -> bool:
        """Whether a sample ends the freeze. Wherever the pose continues from, the motion in between is
        unknown."""
        if self._pose is None or bool(np.all(np.isnan(self._pose) | (odometry.odom_from_base == self._pose))):
            return False
        self._pose = None
        self._stretches[-1] = replace(self._stretches[-1], end=odometry.stamp)
        return True

    def follow(self, stamp: int, step: Pose) -> None:
        """Add a step (3,) until a stamp, as shown by the scans."""
        if self._pose is not None:
            last, moved = self._stretches[-1], float(np.hypot(step[0], step[1]) + abs(step[2]))
            self._stretches[-1] = replace(last, end=stamp, moved=last.moved + moved)

    @property
    def hangs(self) -> bool:
        """Whether it has been frozen long enough by now to warn the user."""
        return self._pose is not None and self._stretches[-1].moved > _TOLD_FROM

    @property
    def told(self) -> list[FrozenStretch]:
        """The stretches to warn the user about."""
        return [stretch for stretch in self._stretches if stretch.moved > _TOLD_FROM]

    def warning(self, start: int) -> str | None:
        """A sentence for the user on when it was frozen, in seconds after ``start`` (nanoseconds); None if
        there is nothing to warn about."""
        told = self.told
        if not told:
            return None
        times = ", ".join(f"{(s.begin - start) * 1e-9:.1f} to {(s.end - start) * 1e-9:.1f}" for s in told)
        return (
            "The odometry repeated one pose, or heading, while the scans moved on: it was left out from "
            f"{times} s after the first scan. Unless the robot was carried, find out why "
            "the odometry's driver hung."
        )
