"""A room to measure filters in: small, so that a sweep of hundreds of drives takes a minute."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.simulation.floor_canvas import FloorCanvas
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

SCAN_PERIOD = 50_000_000
"""Nanoseconds: 20 Hz, the rate that the course asks for."""
_SPEED, _RADIUS = 1.0, 1.0
"""Metres per second and metres; a second turns the car by a radian."""
_BEARINGS: NDArray[np.float64] = np.radians(np.linspace(-135.0, 135.0, 541))
_RANGE_NOISE = 0.01
_MAX_RANGE = 10.0


def draw_lab_room() -> OccupancyGrid:
    """10 × 8 m with furniture; the origin is near its middle."""
    plan = FloorCanvas((-1.0, -1.0), (11.0, 9.0))
    plan.open_box(0.0, 0.0, 10.0, 8.0)
    plan.solid_box(0.0, 6.6, 2.2, 8.0)
    plan.solid_box(8.8, 0.0, 10.0, 1.6)
    plan.solid_box(6.5, 7.5, 8.5, 8.0)
    plan.solid_disc(0.9, 0.9, 0.5)
    plan.solid_disc(9.2, 6.2, 0.25)
    plan.solid_table(4.6, 0.6, 1.6, 0.5, 0.25)
    plan.solid_table(0.7, 4.2, 0.5, 1.0, -0.2)
    return plan.finish(origin=(4.5, 2.7))


@dataclass(frozen=True, eq=False)
class CircleDrive:
    """A car that drives in circles from the origin on, facing along x, and may be put elsewhere meanwhile."""

    grid: OccupancyGrid
    seconds: float
    jump: ArrayLike = (0.0, 0.0, 0.0)
    """(3,) where it is put, added to its pose; its heading must stay."""
    jump_after: float = np.inf
    """Seconds."""

    @property
    def truth(self) -> Trajectory:
        """The pose at each scan."""
        stamps = np.arange(SCAN_PERIOD, int(self.seconds * 1e9) + 1, SCAN_PERIOD, dtype=np.int64)
        poses = self._circle(stamps) + np.where(stamps[:, None] * 1e-9 > self.jump_after, self.jump, 0.0)
        return Trajectory(stamps, poses)

    def messages(self, rng: np.random.Generator) -> Iterator[Measurement]:
        """Exact odometry, which does not notice the jump, and a scan with each sample of it."""
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
