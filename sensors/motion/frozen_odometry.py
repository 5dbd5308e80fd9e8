"""Odometry that repeats one pose while the car drives on: for so long it says nothing of the motion.

A driver that hangs, or a wheel board that lost its bus, sends what it sent last, and so says that the car
stands. A car that stands looks the same; only scans tell the two apart. The wheels of a robot that is carried
do stand while it moves, which nothing tells from a driver that hangs.
"""

from dataclasses import dataclass, replace

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.odometry import Odometry

_TOLD_FROM = 0.5
"""Metres, or radians, that the car must have moved meanwhile until a person should know: less is what stamps
that lag by some tenths of a second make of a car that brakes. By judgement."""


@dataclass(frozen=True)
class FrozenStretch:
    """One time in which odometry repeated a pose."""

    begin: int
    """Nanoseconds, of the first sample with that pose."""
    end: int
    """Nanoseconds, of the first sample with another one, or while there is none of the last scan."""
    moved: float
    """Metres plus radians that the scans show meanwhile."""


class FrozenOdometry:
    """Whether odometry is frozen now, and when it was."""

    def __init__(self) -> None:
        self._pose: Pose | None = None
        self._stretches: list[FrozenStretch] = []

    def copy(self) -> "FrozenOdometry":
        """The same as it is now."""
        other = FrozenOdometry()
        other._pose, other._stretches = self._pose, list(self._stretches)
        return other

    def is_frozen_at(self, stamp: int) -> bool:
        """Whether its poses are not to be believed at a stamp (nanoseconds) since the last was frozen."""
        return self._pose is not None or (bool(self._stretches) and stamp < self._stretches[-1].end)

    def freeze(self, begin: int, odom_from_base: Pose) -> None:
        """Scans contradict the pose (3,) that it repeats since a stamp in nanoseconds; NaN in what may go on
        while the rest does not."""
        self._pose = odom_from_base
        self._stretches.append(FrozenStretch(begin, begin, 0.0))

    def thaws_with(self, odometry: Odometry) -> bool:
        """Whether a sample ends it; where the pose goes on, from there or from elsewhere, nobody knows what
        was between."""
        if self._pose is None or bool(np.all(np.isnan(self._pose) | (odometry.odom_from_base == self._pose))):
            return False
        self._pose = None
        self._stretches[-1] = replace(self._stretches[-1], end=odometry.stamp)
        return True

    def follow(self, stamp: int, step: Pose) -> None:
        """The scans show that the car moved by a step (3,) until a stamp."""
        if self._pose is not None:
            last, moved = self._stretches[-1], float(np.hypot(step[0], step[1]) + abs(step[2]))
            self._stretches[-1] = replace(last, end=stamp, moved=last.moved + moved)

    @property
    def hangs(self) -> bool:
        """Whether it is frozen now, so long that a person should know."""
        return self._pose is not None and self._stretches[-1].moved > _TOLD_FROM

    @property
    def told(self) -> list[FrozenStretch]:
        """The stretches that a person should know of."""
        return [stretch for stretch in self._stretches if stretch.moved > _TOLD_FROM]

    def warning(self, start: int) -> str | None:
        """A sentence for people on when it was, in seconds after a ``start`` (nanoseconds); None where there
        is nothing that a person should know of."""
        told = self.told
        if not told:
            return None
        times = ", ".join(f"{(s.begin - start) * 1e-9:.1f} to {(s.end - start) * 1e-9:.1f}" for s in told)
        return (
            "The odometry repeated one pose, or heading, while the scans moved on: it was left out from "
            f"{times} s after the first scan. If the robot was carried, no action is needed; otherwise find "
            "out why the odometry's driver hung."
        )
