"""Interleaved timing of the localizer's step, its parts, bare loads and the plain filter."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.localizer.measured_drive import MeasuredDrive
from benchmarks.localizer.plain_filter import PlainFilter
from benchmarks.localizer.reference_kernels import add_up_loads
from benchmarks.localizer.stopwatch import Stopwatch
from racecar.localization.filter.particle_filter import cluster_moments, systematic_resample
from racecar.localization.recovery.lookout import Lookout
from racecar.localization.recovery.perception import Perception
from racecar.maps.geometry.se2 import Pose, between, inverse, transform_points
from racecar.pipelines.simulation.laser_models import UST_10LX

PARTS = ("end points", "sensor", "resampling", "moments", "refinement", "lookout")
"""The parts of the step that can be measured separately."""
_START_DEVIATIONS = np.array([0.05, 0.05, 0.02])
"""Metres and radians, for the plain filter's first cloud."""


class InterleavedTiming:
    """The comparison on one drive. All caches are warm, as in a tight loop."""

    def __init__(
        self, drive: MeasuredDrive, perception: Perception, spread_particles: int, rng: np.random.Generator
    ) -> None:
        """The sensor is also measured on particles all over the map."""
        self.resampled: list[bool] = []
        self.errors: list[float] = []
        """Metres from the truth after each step."""
        self.plain_errors: list[float] = []
        self._drive, self._perception, self._rng = drive, perception, rng
        self._spread = perception.free_space.draw_poses(spread_particles, rng)
        start = drive.step.map_from_base + _START_DEVIATIONS * rng.standard_normal(
            (drive.config.particles, 3)
        )
        self._plain = PlainFilter(perception.walls.grid, drive.step.scan.max_range, start, rng)
        self._plain_odometry = drive.odom_from_base

    def take(self, steps: int, watch: Stopwatch) -> None:
        """Time this many steps of the localizer, its parts and the bare loads, and the others once."""
        for _ in range(steps):
            self._drive.next_step()
            estimate = watch.time("step", self._drive.feed)
            self.errors.append(_distance(estimate.map_from_base, self._drive.step.map_from_base))
            self.resampled.append(estimate.effective_sample_size < 0.5 * estimate.particle_count)
        self._time_parts(steps, watch)
        places, offsets, codes = self._loads()
        watch.time_warm("loads", lambda: add_up_loads(places, offsets, codes), steps)
        points = self._drive.points
        watch.time("spread sensor", lambda: self._perception.log_likelihood(self._spread, points))
        step = between(self._plain_odometry, self._drive.odom_from_base)
        self._plain_odometry = self._drive.odom_from_base
        map_from_base = watch.time("plain step", lambda: self._plain.step(step, points))
        self.plain_errors.append(_distance(map_from_base, self._drive.step.map_from_base))

    def _time_parts(self, repetitions: int, watch: Stopwatch) -> None:
        cloud, _ = self._drive.localizer.particles()
        weights = self._rng.dirichlet(np.ones(len(cloud)))

        def moments() -> tuple[Pose, NDArray[np.float64], float]:
            return cluster_moments(cloud, weights)

        mean, covariance, _ = moments()
        points, perception, lookout = self._drive.points, self._perception, Lookout()
        parts = {
            "end points": lambda: self._drive.points,
            "sensor": lambda: perception.log_likelihood(cloud, points),
            "resampling": lambda: cloud[systematic_resample(weights, len(cloud), self._rng)],
            "moments": moments,
            "refinement": lambda: perception.aligned(mean, covariance, points),
            "lookout": lambda: lookout.look(mean, points, UST_10LX.scan_time, perception),
        }
        for name in PARTS:
            watch.time_warm(name, parts[name], repetitions)

    def _loads(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.uint8]]:
        """Flat indices (N,) of the cloud's places in the field's codes, and offsets (P,) of the points.

        As if all particles had the same heading.
        """
        field, (cloud, _) = self._perception.field, self._drive.localizer.particles()
        grid = self._perception.walls.grid
        columns, per_metre = field.codes.shape[1], 1.0 / field.pixel

        def places_of(points: NDArray[np.float64]) -> NDArray[np.int64]:
            pixels = transform_points(inverse(grid.map_from_grid), points) * per_metre + 1.0
            column, row = pixels.astype(np.int64).T
            return np.asarray(row * columns + column)

        places = places_of(cloud[:, :2])
        offsets = places_of(transform_points(cloud[0], self._drive.points.in_base)) - places[0]
        codes = field.codes.ravel()
        return places, np.clip(offsets, -places.min(), len(codes) - 1 - places.max()), codes


def _distance(pose: Pose, other: Pose) -> float:
    return float(np.hypot(*(pose - other)[:2]))
