"""The reference: a plain particle filter as taught in MIT's robotics course (RSS, lab 5).

It shares no code with `localization`, so a bug there is not compared with itself. It avoids the known
mistakes of students: headings are averaged on the circle, noise is added in the car's frame, all odometry
between two scans counts, and log-probabilities are summed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, mean_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

Z_MAX = 200
"""Maximum distance, in pixels of the map."""
_SIGMA_HIT = 8.0
"""Pixels."""
_ALPHA_HIT, _ALPHA_SHORT, _ALPHA_MAX, _ALPHA_RAND = 0.74, 0.07, 0.07, 0.12
_SQUASH = 2.2
"""The lab's values: weights of the mixture, and the root taken of a scan's likelihood."""


@dataclass(frozen=True)
class CourseSettings:
    """The lab's parameters, with its usual values."""

    particles: int = 200
    beams: int = 99
    noise: float = 0.03
    """Standard deviation in metres and radians added at every update, whether the car moves or not."""


@dataclass(frozen=True, eq=False)
class CourseEstimate:
    """The filter's estimate after a scan."""

    map_from_base: Pose
    effective_sample_size: float


class CourseFilter:
    """Predict with each odometry increment plus Gaussian noise, weigh with the table, resample, average."""

    def __init__(self, grid: OccupancyGrid, settings: CourseSettings, rng: np.random.Generator) -> None:
        self._grid, self._settings, self._rng = grid, settings, rng
        self._log_table = np.log(sensor_table())
        self._particles: Pose = np.zeros((settings.particles, 3))
        self._odom_from_base: Pose | None = None
        self._step: Pose = IDENTITY

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64]) -> None:
        """Draw the particles from a normal distribution around a pose (3,)."""
        spread = self._rng.multivariate_normal(np.zeros(3), covariance, size=self._settings.particles)
        self._particles = map_from_base + spread

    def add_odometry(self, odometry: Odometry) -> None:
        """Accumulate the motion until the next scan."""
        if self._odom_from_base is not None:
            self._step = compose(self._step, between(self._odom_from_base, odometry.odom_from_base))
        self._odom_from_base = odometry.odom_from_base

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Ignored: the course's filter uses no gyroscope."""

    def add_scan(self, scan: Scan) -> CourseEstimate:
        """Predict, weigh, resample; the estimate is the mean of the particles."""
        self._predict()
        weights = self._weights(scan)
        chosen = self._rng.choice(len(weights), size=len(weights), p=weights)
        self._particles = self._particles[chosen]
        x, y = self._particles[:, :2].mean(axis=0)
        mean = np.array([x, y, mean_angle(self._particles[:, 2])])
        return CourseEstimate(mean, float(1.0 / np.sum(weights**2)))

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """(N, 3) poses and their weights (N,), equal after resampling."""
        return self._particles.copy(), np.full(len(self._particles), 1.0 / len(self._particles))

    def _predict(self) -> None:
        noise = self._settings.noise * self._rng.standard_normal(self._particles.shape)
        self._particles = compose(self._particles, self._step + noise)
        self._step = IDENTITY

    def _weights(self, scan: Scan) -> NDArray[np.float64]:
        """(N,) normalized weights, which sum to 1."""
        chosen = np.linspace(0, len(scan.bearings) - 1, self._settings.beams).astype(int)
        chosen = chosen[~np.isnan(scan.ranges[chosen])]
        map_from_laser = compose(self._particles, scan.base_from_laser)
        expected = cast_ray_fan(self._grid, map_from_laser, scan.bearings[chosen], scan.max_range)
        log_probabilities = self._log_table[self._pixels(scan.ranges[chosen]), self._pixels(expected)]
        log_weights = log_probabilities.sum(axis=1) / _SQUASH
        weights: NDArray[np.float64] = np.exp(log_weights - log_weights.max())
        normalized: NDArray[np.float64] = weights / weights.sum()
        return normalized

    def _pixels(self, ranges: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.clip(np.rint(ranges / self._grid.resolution), 0, Z_MAX).astype(np.int64)


def sensor_table(z_max: int = Z_MAX) -> NDArray[np.float64]:
    """(z_max + 1, z_max + 1) probability of measuring z (row) where the map has d (column), in pixels."""
    columns = [sum(mixture_parts(d, z_max).values(), np.zeros(z_max + 1)) for d in range(z_max + 1)]
    return np.column_stack([column / column.sum() for column in columns])


def mixture_parts(d: int, z_max: int = Z_MAX) -> dict[str, NDArray[np.float64]]:
    """The four weighted parts (z_max + 1,) of the probability of each z where the map has d."""
    z = np.arange(z_max + 1)
    hit = np.exp(-((z - d) ** 2) / (2.0 * _SIGMA_HIT**2))
    short = np.zeros(z_max + 1)
    if d != 0:
        short[: d + 1] = 2.0 / d * (1.0 - z[: d + 1] / d)
    return {
        "hit": _ALPHA_HIT * hit / hit.sum(),
        "short": _ALPHA_SHORT * short,
        "maximum": _ALPHA_MAX * (z == z_max),
        "random": np.full(z_max + 1, _ALPHA_RAND / z_max),
    }
