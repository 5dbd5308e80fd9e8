"""A planar LiDAR scan."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import angle_slip, as_array, as_pose
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.sensors.cloud import Cloud

FARTHEST_APART = math.radians(8.0)
"""Radians, seen from the sensor, between returns that may lie on one surface. Chosen by judgement: on a wall
at 7 degrees incidence, beams one degree apart leave no wider gap. Measured on a simulated drive of 360 beams,
thinned: 33, 11° apart, yield not one match and the wheels' error of 0.18 m, 60, 6° apart, 0.05 m."""


LONGEST_RANGE = 1000.0
"""Metres; no laser scanner sees that far, so larger values are not its range, or in millimetres. Chosen by
judgement."""


@checked
@dataclass(frozen=True, eq=False)
class Scan:
    """A sweep of N beams, in ascending order of bearing.

    ``ranges`` are finite for a return, ``inf`` for a miss (nothing within ``max_range``) and ``nan`` for no
    information (NaN padding, zeros, readings below the sensor's minimum). Raises UserError when shapes or
    units are wrong.
    """

    stamp: int
    """Nanoseconds; the time of the sweep's pose (the header stamp)."""
    bearings: NDArray[np.float64]
    """(N,) radians in the laser frame, strictly ascending."""
    ranges: NDArray[np.float64]
    """(N,) metres."""
    time_offsets: NDArray[np.float64]
    """(N,) seconds from ``stamp`` to each beam; all zero when the sensor does not report them."""
    base_from_laser: Pose
    """(3,) pose of the sensor on the car."""
    max_range: float
    """Metres; readings at or beyond it are misses."""
    cloud: Cloud | None = None
    """The full cloud of a multi-row sensor, of which the beams are a slice; None for a planar sensor."""
    laser: int = 0
    """Index of the laser on the car, from 0; scans with one index share a mount."""

    def __post_init__(self) -> None:
        bearings = as_array(self.bearings, "The bearings of a scan", (None,))
        beams = (len(bearings),)
        ranges = as_array(self.ranges, "The ranges of a scan", beams)
        given = {
            "bearings": bearings,
            "ranges": ranges,
            "time_offsets": as_array(self.time_offsets, "The time_offsets of a scan", beams),
            "base_from_laser": as_pose(self.base_from_laser, "The base_from_laser of a scan"),
        }
        for name, array in given.items():
            object.__setattr__(self, name, array)
        if not 0.0 < self.max_range <= LONGEST_RANGE:
            raise UserError(
                f"The max_range of a scan is {self.max_range:g}; give metres, {LONGEST_RANGE:g} at most."
            )
        if not len(bearings):
            return
        for bearing in (bearings.item(0), bearings.item(-1)):  # the extremes, as they ascend
            if (slip := angle_slip("bearing", bearing)) is not None:
                raise UserError(f"The bearings of a scan cannot be used: {slip}.")

    @property
    def is_return(self) -> NDArray[np.bool_]:
        """(N,) whether a beam hit something."""
        return np.isfinite(self.ranges)

    def points_in_laser(self) -> NDArray[np.float64]:
        """(M, 2) end points of the returns."""
        hit = self.is_return
        ranges, bearings = self.ranges[hit], self.bearings[hit]
        return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])

    def points_in_base(self) -> NDArray[np.float64]:
        """(M, 2) end points of the returns, without deskewing."""
        return transform_points(self.base_from_laser, self.points_in_laser())


def frozen(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Make an array read-only, because many scans share it."""
    values.flags.writeable = False
    return values
