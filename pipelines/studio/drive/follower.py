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
        self.errors.append(Deviation(seconds, float(np.hypot(*off[:2])), abs(float(wrap_angle(off[2])))))
