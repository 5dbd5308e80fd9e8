"""The localizer's step, its parts, bare loads and the plain filter, timed in turns."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.cluster_kernels import cluster_moments
from racecar.localization.filter.resampling_kernels import systematic_resample
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_table import RangeTable
from racecar.localization.floor.walls import find_walls
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beam_model import BeamModel
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.pipelines.benchmarks.localizer.measured_drive import MeasuredDrive
from racecar.pipelines.benchmarks.localizer.plain_filter import PlainFilter
from racecar.pipelines.benchmarks.localizer.reference_kernels import add_up_loads, add_up_scattered_loads
from racecar.pipelines.benchmarks.localizer.stopwatch import Stopwatch

PARTS = ("beams", "sensor", "resampling", "moments", "refinement")
"""Of the step, those that can be measured alone."""
_START_DEVIATIONS = np.array([0.05, 0.05, 0.02])
"""Metres and radians, of the plain filter's first cloud."""


class InterleavedTiming:
    """What is compared, on one drive. Everything finds the caches warm, as in a tight loop."""

    def __init__(
        self,
        drive: MeasuredDrive,
        model: BeamModel,
        free_space: FreeSpace,
        table: RangeTable,
        spread_particles: int,
        rng: np.random.Generator,
    ) -> None:
        """Of the step the sensor, as ``model`` does it, is also measured on particles all over the map."""
        self.resampled: list[bool] = []
        self.errors: list[float] = []
        """Metres from the truth after each step."""
        self.plain_errors: list[float] = []
        self._drive, self._model, self._free_space, self._table, self._rng = (
            drive,
            model,
            free_space,
            table,
            rng,
        )
        particles, beams = drive.config.particles, drive.config.beams
        self._walls = find_walls(free_space.grid)
        self._spread = free_space.draw_poses(spread_particles, rng)
        self._columns = rng.integers(table.headings, size=beams)
        self._anywhere = rng.integers(table.ranges.size, size=(particles, beams), dtype=np.uint32)
        self._sensor_table = rng.integers(1000, size=(beams, 256), dtype=np.int32)
        start = drive.step.map_from_base + _START_DEVIATIONS * rng.standard_normal((particles, 3))
        self._plain = PlainFilter(free_space.grid, drive.step.scan.max_range, start, rng)
        self._plain_odometry = drive.odom_from_base

    def take(self, steps: int, watch: Stopwatch) -> None:
        """Time some steps of the localizer, its parts and the bare loads as often, the others once."""
        for _ in range(steps):
            self._drive.next_step()
            estimate = watch.time("step", self._drive.feed)
            self.errors.append(_distance(estimate.map_from_base, self._drive.step.map_from_base))
            self.resampled.append(estimate.effective_sample_size < 0.5 * estimate.particle_count)
        self._time_parts(steps, watch)
        self._time_loads(steps, watch)
        beams = self._drive.beams
        watch.time("spread sensor", lambda: self._model.log_likelihood(self._spread, beams))
        step = between(self._plain_odometry, self._drive.odom_from_base)
        self._plain_odometry = self._drive.odom_from_base
        map_from_base = watch.time("plain step", lambda: self._plain.step(step, beams))
        self.plain_errors.append(_distance(map_from_base, self._drive.step.map_from_base))

    def _time_parts(self, repetitions: int, watch: Stopwatch) -> None:
        cloud, _ = self._drive.localizer.particles()
        weights = self._rng.dirichlet(np.ones(len(cloud)))
        clusters = self._drive.config.particle_filter.clusters

        def moments() -> tuple[Pose, NDArray[np.float64], float]:
            return cluster_moments(cloud, weights, clusters.place_size, clusters.radius, clusters.half_angle)

        mean, covariance, _ = moments()
        beams = self._drive.beams
        parts = {
            "beams": lambda: self._drive.beams,
            "sensor": lambda: self._model.log_likelihood(cloud, beams),
            "resampling": lambda: cloud[systematic_resample(weights, len(cloud), self._rng)],
            "moments": moments,
            "refinement": lambda: refine(mean, covariance, beams, self._walls, self._drive.config.alignment),
        }
        for name in PARTS:
            watch.time_warm(name, parts[name], repetitions)

    def _time_loads(self, repetitions: int, watch: Stopwatch) -> None:
        rows, table = self._rows(), self._table
        watch.time_warm(
            "loads",
            lambda: add_up_loads(rows, self._columns, table.ranges, self._sensor_table),
            repetitions,
        )
        watch.time_warm(
            "scattered loads",
            lambda: add_up_scattered_loads(self._anywhere, table.ranges.ravel(), self._sensor_table),
            repetitions,
        )

    def _rows(self) -> NDArray[np.int64]:
        """(N,) of the table, for the laser at each particle."""
        cloud, _ = self._drive.localizer.particles()
        places = compose(cloud, self._drive.step.scan.base_from_laser)[:, :2]
        inside = places[self._free_space.contains(places)]
        cells = self._free_space.grid.cell_of(np.resize(inside, places.shape))
        rows: NDArray[np.int64] = self._table.cell_index[tuple(cells.T)].astype(np.int64)
        return rows


def _distance(pose: Pose, other: Pose) -> float:
    return float(np.hypot(*(pose - other)[:2]))
