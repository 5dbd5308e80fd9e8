"""Whoever tells from the sensors where the car is, held against the truth."""

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
"""Frames whose errors are kept: a minute."""


class Deviation(NamedTuple):
    """How far the believed pose is off."""

    seconds: float
    metres: float
    radians: float


class Follower(ABC):
    """A localizer that knows the map, or a mapper that discovers it."""

    def __init__(self) -> None:
        self.errors: deque[Deviation] = deque(maxlen=_REMEMBERED)
        """Of the last minute."""

    @abstractmethod
    def take(self, measured: list[Measurement], truth: Pose, seconds: float) -> None:
        """Follow the sensors for a while, at whose end, after so many seconds of the drive, the car is at the
        true pose (3,)."""

    @abstractmethod
    def glimpse(self, scan: Scan | None) -> Glimpse | None:
        """The car as it is believed to be, seeing a scan; None before anything is believed."""

    @abstractmethod
    def words(self) -> str:
        """How it goes, in Markdown."""

    def map(self) -> OccupancyGrid | None:
        """The map as far as it is known, in the world; None: as it was shown before."""
        return None

    def note_error(self, pose: Pose, truth: Pose, seconds: float) -> None:
        """A believed pose (3,) beside the true one."""
        off = pose - truth
        self.errors.append(Deviation(seconds, float(np.hypot(*off[:2])), abs(float(wrap_angle(off[2])))))
