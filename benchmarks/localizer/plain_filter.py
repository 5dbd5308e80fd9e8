"""A plain implementation of the usual particle filter, the reference for the localizer's speed.

Rays are marched through the distance field by numba. The rest is plain NumPy: a look-up in the sensor table,
``random.choice``, the mean of the particles.
"""

import numpy as np
from numpy.typing import NDArray

from benchmarks.localizer.reference_kernels import march_rays
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose, between, compose, mean_angle
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.runs.evaluation.course_filter import sensor_table

_NOISE = 0.02
"""Metres and radians added by every step."""
_SQUASH = 2.2
"""The root taken of a scan's likelihood; the value used in the course."""


class PlainFilter:
    """Motion, sensor, resampling and estimate, with nothing precomputed but the distance field."""

    def __init__(
        self, grid: OccupancyGrid, max_range: float, map_from_base: Pose, rng: np.random.Generator
    ) -> None:
        """Start from particles (N, 3)."""
        self._map_from_grid, self._resolution = grid.map_from_grid, grid.resolution
        self._distances = (distance_to_occupied(grid) / grid.resolution).astype(np.float32)
        self._reach = round(max_range / grid.resolution)
        self._log_table = np.log(sensor_table(self._reach))
        self._particles = map_from_base
        self._rng = rng

    def step(self, base_from_next_base: Pose, points: EndPoints) -> Pose:
        """(3,) pose after an odometry increment (3,) and a scan."""
        noise = _NOISE * self._rng.standard_normal(self._particles.shape)
        self._particles = compose(self._particles, base_from_next_base + noise)
        weights = self._weights(points)
        chosen = self._rng.choice(len(weights), size=len(weights), p=weights)
        self._particles = self._particles[chosen]
        x, y = self._particles[:, :2].mean(axis=0)
        return np.array([x, y, mean_angle(self._particles[:, 2])])

    def expected_cells(self, points: EndPoints) -> NDArray[np.float64]:
        """(N, P) ranges expected from the map for each particle, in cells."""
        starts = between(self._map_from_grid, compose(self._particles, [*points.laser, 0.0]))
        starts[:, :2] /= self._resolution
        x, y = (points.in_base - points.laser).T
        return march_rays(self._distances, starts, np.arctan2(y, x), float(self._reach))

    def _weights(self, points: EndPoints) -> NDArray[np.float64]:
        ranges = np.hypot(*(points.in_base - points.laser).T)
        measured = np.clip(np.rint(ranges / self._resolution), 0, self._reach).astype(np.int64)
        expected = np.rint(self.expected_cells(points)).astype(np.int64)
        log_weights = self._log_table[measured, expected].sum(axis=1) / _SQUASH
        weights: NDArray[np.float64] = np.exp(log_weights - log_weights.max())
        normalized: NDArray[np.float64] = weights / weights.sum()
        return normalized
