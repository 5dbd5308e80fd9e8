"""One sweep of a LiDAR, as seen in the plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.sensors.cloud import Cloud


@dataclass(frozen=True, eq=False)
class Scan:
    """A sweep of N beams, ascending in bearing.

    ``ranges`` tell three things apart: a finite number is a return, ``inf`` a miss (nothing within
    ``max_range``) and ``nan`` no information (NaN padding, zeros, readings below the sensor's minimum).
    """

    stamp: int
    """Nanoseconds; the time to which the sweep's pose belongs (the header stamp)."""
    bearings: NDArray[np.float64]
    """(N,) radians in the laser frame, strictly ascending."""
    ranges: NDArray[np.float64]
    """(N,) metres."""
    time_offsets: NDArray[np.float64]
    """(N,) seconds from ``stamp`` to each beam; all zero when the sensor does not tell."""
    base_from_laser: Pose
    """(3,) the sensor's place on the car."""
    max_range: float
    """Metres; readings at or beyond are misses."""
    cloud: Cloud | None = None
    """All that a sensor with many rows saw, of which the beams are a section; None of a planar sensor."""
    laser: int = 0
    """Which of the car's lasers, numbered from 0; those of one number are at one place."""

    @property
    def is_return(self) -> NDArray[np.bool_]:
        """(N,) beams that met something."""
        return np.isfinite(self.ranges)

    def points_in_laser(self) -> NDArray[np.float64]:
        """(M, 2) end points of the returns."""
        hit = self.is_return
        ranges, bearings = self.ranges[hit], self.bearings[hit]
        return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])

    def points_in_base(self) -> NDArray[np.float64]:
        """(M, 2) end points of the returns, not corrected for the car's motion during the sweep."""
        return transform_points(self.base_from_laser, self.points_in_laser())


def frozen(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The array itself, not writeable from now on, because many scans share it."""
    values.flags.writeable = False
    return values
