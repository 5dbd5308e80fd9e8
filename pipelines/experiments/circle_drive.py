"""A drive in circles to evaluate filters: short, so that a sweep of hundreds takes a minute."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

SCAN_PERIOD = 50_000_000
"""Nanoseconds: 20 Hz, the rate required by the course."""
_SPEED, _RADIUS = 1.0, 1.0
"""Metres per second and metres; the car turns by a radian per second."""
_BEARINGS: NDArray[np.float64] = np.radians(np.linspace(-135.0, 135.0, 541))
_RANGE_NOISE = 0.01
_MAX_RANGE = 10.0


@dataclass(frozen=True, eq=False)
class CircleDrive:
    """A car that drives in circles through the lab room, starting at the origin and facing along x; it may be
    moved meanwhile."""

    seconds: float
    jump: ArrayLike = (0.0, 0.0, 0.0)
    """(3,) offset added to its pose; its heading must not change."""
    jump_after: float = np.inf
    """Seconds."""
    grid: OccupancyGrid = field(init=False, default_factory=partial(load_map, "lab_room"))

    @property
    def truth(self) -> Trajectory:
        """The pose at each scan."""
        stamps = np.arange(SCAN_PERIOD, int(self.seconds * 1e9) + 1, SCAN_PERIOD, dtype=np.int64)
        poses = self._circle(stamps) + np.where(stamps[:, None] * 1e-9 > self.jump_after, self.jump, 0.0)
        return Trajectory(stamps, poses)

    def messages(self, rng: np.random.Generator) -> Iterator[Measurement]:
        """Exact odometry, which does not include the jump, and a scan with each sample."""
        truth = self.truth
        yield Odometry(0, self._circle(np.zeros(1))[0], np.zeros(3))
        for stamp, odom_from_base, pose in zip(
            truth.stamps.tolist(), self._circle(truth.stamps), truth.map_from_base, strict=True
        ):
            yield Odometry(stamp, odom_from_base, np.array([_SPEED, 0.0, _SPEED / _RADIUS]))
            yield self._scan(stamp, pose, rng)

    def _circle(self, stamps: NDArray[np.int64] | NDArray[np.float64]) -> Pose:
        turn = stamps * 1e-9 * _SPEED / _RADIUS
        wrapped = np.arctan2(np.sin(turn), np.cos(turn))
        return np.column_stack([_RADIUS * np.sin(turn), _RADIUS * (1.0 - np.cos(turn)), wrapped])

    def _scan(self, stamp: int, map_from_base: Pose, rng: np.random.Generator) -> Scan:
        true = cast_ray_fan(self.grid, map_from_base[None], _BEARINGS, _MAX_RANGE)[0]
        ranges = np.maximum(true + _RANGE_NOISE * rng.standard_normal(len(true)), 0.0)
        return Scan(stamp, _BEARINGS, ranges, np.zeros(len(true)), np.zeros(3), _MAX_RANGE)
