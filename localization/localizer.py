"""The localizer of a live car: odometry and scans in, poses out."""

from threading import Lock

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams, select_beams
from localization.config import LocalizationConfig
from localization.motion_source import RESTART_SECONDS, MotionSource, MotionStep
from localization.particle_filter import ParticleFilter
from localization.pose_estimate import PoseEstimate
from localization.range_table import build_range_table
from localization.tempering import temper
from localization.weighing import scan_log_likelihood
from maps.errors import UserError
from maps.occupancy_grid import OccupancyGrid
from maps.odometry import Odometry
from maps.scan import Scan
from maps.se2 import Pose

_NEWS_AFTER = 0.02
"""Metres plus radians of motion after which a scan tells something new. Scans of a car that stands repeat
themselves; counted as independent, they would narrow the cloud to a point."""
_FIRST_PARTICLES_PER_AREA = 400
_MOST_FIRST_PARTICLES = 1_000_000
_TRACKED_WITHIN = 0.5
"""Metres of standard deviation within which the place counts as known."""


class Localizer:
    """Tells the car's pose on a map; its methods may be called from several threads at once."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Builds the map's range table, which takes a few seconds on a large map.

        Raises UserError when the map has no free space or too much of it.
        """
        self._table = build_range_table(grid, config.table_megabytes)
        self._config = config
        self._rng = rng
        self._lock = Lock()
        self._motion = MotionSource(config)
        self._last_stamp: int | None = None
        self._moved_since_weighing = 0.0
        self._scatter()

    def set_pose(self, map_from_base: Pose) -> None:
        """Start anew about a pose (3,). Raises UserError when it is not finite or far from the map's free space."""
        pose = np.asarray(map_from_base, dtype=np.float64)
        if not np.all(np.isfinite(pose)):
            raise UserError(
                "The initial pose is not three finite numbers; give x and y in metres and yaw in radians."
            )
        spread = [self._config.start_spread, self._config.start_spread, self._config.start_heading_spread]
        with self._lock:
            drawn = pose + spread * self._rng.standard_normal((self._config.particles, 3))
            possible = drawn[self._table.free_space.contains(drawn[:, :2])]
            if len(possible) == 0:
                raise UserError(
                    f"The initial pose ({pose[0]:.2f}, {pose[1]:.2f}) is not on the map's free space; "
                    "give a pose where the car can stand, or search the whole map."
                )
            self._start_from(np.resize(possible, drawn.shape))

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._scatter()

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        with self._lock:
            self._motion.add(odometry)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            if self._is_late(scan.stamp):
                return self._filter.estimate(self._last_stamp or scan.stamp)
            self._last_stamp = scan.stamp
            step = self._motion.step_to(scan.stamp)
            self._filter.predict(step.base_from_next_base, step.deviation)
            odometry = self._motion.odometry_about(scan.stamp)
            beams = select_beams(scan, self._config.beams, odometry)
            if len(beams) > 0 and self._is_news(step):
                self._weigh(beams)
            estimate = self._filter.estimate(scan.stamp)
            self._filter.resample(min(len(self._filter), self._wanted_particles(estimate)))
            self._motion.follow(scan.stamp, estimate.map_from_base)
            return estimate

    def _scatter(self) -> None:
        grid = self._table.free_space.grid
        area = self._table.free_space.cell_count * grid.resolution**2
        count = int(
            np.clip(area * _FIRST_PARTICLES_PER_AREA, self._config.scattered_particles, _MOST_FIRST_PARTICLES)
        )
        self._start_from(self._table.free_space.draw_poses(count, self._rng))

    def _start_from(self, map_from_base: Pose) -> None:
        self._filter = ParticleFilter(map_from_base, self._rng)
        self._is_first_scan = True
        self._motion.forget_speed()

    def _is_late(self, stamp: int) -> bool:
        return self._last_stamp is not None and 0 <= self._last_stamp - stamp < RESTART_SECONDS * 1e9

    def _is_news(self, step: MotionStep) -> bool:
        x, y, yaw = step.base_from_next_base
        self._moved_since_weighing += np.hypot(x, y) + abs(yaw)
        return self._is_first_scan or not step.is_measured or self._moved_since_weighing >= _NEWS_AFTER

    def _weigh(self, beams: Beams) -> None:
        self._moved_since_weighing = 0.0
        if self._is_first_scan:
            self._is_first_scan = False
            self._settle(beams)
        else:
            self._filter.weigh(self._log_likelihood(self._filter.map_from_base, beams))

    def _settle(self, beams: Beams) -> None:
        """Take in the first scan, for which the cloud is too thin to be weighed at once."""
        count = min(len(self._filter), self._config.scattered_particles)
        particles = temper(
            self._filter.map_from_base, lambda poses: self._log_likelihood(poses, beams), count, self._rng
        )
        self._filter = ParticleFilter(particles, self._rng)

    def _log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        return scan_log_likelihood(map_from_base, beams, self._table, self._config.squash)

    def _wanted_particles(self, estimate: PoseEstimate) -> int:
        deviation = np.sqrt(np.trace(estimate.covariance[:2, :2]))
        is_tracked = estimate.cluster_weight > 0.9 and deviation < _TRACKED_WITHIN
        return self._config.particles if is_tracked else self._config.scattered_particles
