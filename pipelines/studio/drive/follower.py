"""Estimate the car's pose from the sensors, and compare it with the truth."""

from abc import ABC, abstractmethod
from collections import deque
from typing import NamedTuple

import numpy as np

from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_REMEMBERED = 1200
"""Number of frames whose errors are kept: a minute."""


_ASTRAY, _FOUND = 1.0, 0.3
"""Metres of error from which an estimate is far off, and below which it is right again. Chosen by judgement:
more than a car's length, and about its width."""


class Deviation(NamedTuple):
    """Error of the estimated pose."""

    seconds: float
    metres: float
    radians: float


class Follower(ABC):
    """A localizer on a known map, or a mapper that explores it."""

    def __init__(self) -> None:
        self.errors: deque[Deviation] = deque(maxlen=_REMEMBERED)
        """Errors of the last minute."""
        self.found_after: float | None = None
        """Seconds for which the estimate was far off, the last time that it was; None before."""
        self._astray_since: float | None = None

    @abstractmethod
    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        """Process sensor data of some time; ``seconds`` into the drive, at its end, the true pose is
        ``truth`` (3,)."""

    @abstractmethod
    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        """The car's estimate with a scan; None before the first estimate."""

    @abstractmethod
    def words(self) -> str:
        """The current state, in Markdown."""

    def map(self) -> OccupancyGrid | None:
        """The map known so far, in the world; None if it has not changed."""
        return None

    def note_error(self, pose: Pose, truth: Pose, seconds: float) -> None:
        """Record the error of an estimated pose (3,) against the true one."""
        off = pose - truth
        error = Deviation(seconds, float(np.hypot(*off[:2])), abs(float(wrap_angle(off[2]))))
        self.errors.append(error)
        if error.metres > _ASTRAY:
            self._astray_since = seconds if self._astray_since is None else self._astray_since
        elif error.metres < _FOUND and self._astray_since is not None:
            self.found_after, self._astray_since = seconds - self._astray_since, None
