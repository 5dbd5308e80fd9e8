"""The localizer of a live car: odometry and scans in, poses out."""

from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams, select_beams
from localization.config import LocalizationConfig
from localization.motion_source import RESTART_SECONDS, MotionSource, MotionStep
from localization.particle_filter import ParticleFilter
from localization.pose_estimate import PoseEstimate
from localization.range_table import build_range_table
from localization.refinement import find_walls, refine
from localization.start_poses import draw_about, draw_anywhere, draw_start
from localization.tempering import temper
from localization.weighing import scan_log_likelihood
from maps.occupancy_grid import OccupancyGrid
from maps.odometry import Odometry
from maps.scan import Scan
from maps.se2 import Pose

_NEWS_AFTER = 0.02
"""Metres plus radians of motion after which a scan tells something new. Scans of a car that stands repeat
themselves; counted as independent, they would narrow the cloud to a point."""
_LOST_FIT = -4.5
_LOST_AFTER = 20
"""A good pose on a fair map explains a beam with a mean log-probability of -3.2 to -4; when the best
particle stays below this fit for so many scans, the filter starts over."""
_GAP_SECONDS = 2.0
"""Between two scans; in a longer one the car may have been carried to anywhere."""
_TRACKED_WITHIN = 0.5
"""Metres of standard deviation within which the place counts as known."""


class Localizer:
    """Tells the car's pose on a map; its methods may be called from several threads at once."""

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Builds the map's range table, which takes a few seconds on a large map.

        Raises UserError when the map has no free space or too much of it.
        """
        self._table = build_range_table(grid, config.table_megabytes)
        self._walls = find_walls(grid)
        self._config = config
        self._rng = rng
        self._lock = Lock()
        self._motion = MotionSource(config)
        self._last_stamp: int | None = None
        self._travel_since_weighing = 0.0
        self._scatter()

    def set_pose(self, map_from_base: Pose) -> None:
        """Start anew about a pose (3,).

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            self._start_from(draw_start(map_from_base, self._table.free_space, self._config, self._rng))

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
                return self._filter.estimate(self._last_stamp or scan.stamp, is_start=False)
            is_after_gap = self._is_after_gap(scan.stamp)
            self._last_stamp = scan.stamp
            step = self._motion.step_to(scan.stamp)
            self._filter.predict(step.base_from_next_base, step.deviations)
            if self._is_settled and (is_after_gap or self._lost_scans >= _LOST_AFTER):
                self._start_over(self._filter.estimate(scan.stamp, is_start=False))
            was_settled = self._is_settled
            beams = select_beams(scan, self._config.beams, self._motion.odometry_about(scan.stamp))
            if len(beams) > 0 and self._is_news(step):
                self._weigh(beams)
            estimate = self._filter.estimate(scan.stamp, is_start=not was_settled)
            if self._is_tracked(estimate):
                estimate = replace(estimate, map_from_base=refine(estimate.map_from_base, beams, self._walls))
            self._filter.resample(min(len(self._filter), self._wanted_particles(estimate)))
            self._motion.follow(scan.stamp, estimate.map_from_base)
            return estimate

    def _scatter(self) -> None:
        self._start_from(draw_anywhere(self._table.free_space, self._config, self._rng))

    def _start_from(self, map_from_base: Pose) -> None:
        self._filter = ParticleFilter(map_from_base, self._rng)
        self._is_settled = False
        self._lost_scans = 0
        self._motion.forget_speed()

    def _start_over(self, last: PoseEstimate) -> None:
        """Search about the last pose and, more thinly, the whole map; the next scan decides."""
        nearby = draw_about(last.map_from_base, self._config.scattered_particles, self._config, self._rng)
        anywhere = draw_anywhere(self._table.free_space, self._config, self._rng)
        self._start_from(np.concatenate([nearby, anywhere]))

    def _is_late(self, stamp: int) -> bool:
        return self._last_stamp is not None and 0 <= self._last_stamp - stamp < RESTART_SECONDS * 1e9

    def _is_after_gap(self, stamp: int) -> bool:
        return self._last_stamp is not None and abs(stamp - self._last_stamp) > _GAP_SECONDS * 1e9

    def _is_news(self, step: MotionStep) -> bool:
        self._travel_since_weighing += step.travel
        return not self._is_settled or self._travel_since_weighing >= _NEWS_AFTER

    def _weigh(self, beams: Beams) -> None:
        self._travel_since_weighing = 0.0
        if self._is_settled:
            log_likelihood = self._log_likelihood(self._filter.map_from_base, beams)
            self._filter.weigh(log_likelihood)
            fit = log_likelihood.max() * self._config.squash / len(beams)
            self._lost_scans = self._lost_scans + 1 if fit < _LOST_FIT else 0
        else:
            self._settle(beams)

    def _settle(self, beams: Beams) -> None:
        """Take in a first scan, for which the cloud is too thin to be weighed at once."""
        count = min(len(self._filter), self._config.scattered_particles)
        particles = temper(
            self._filter.map_from_base, lambda poses: self._log_likelihood(poses, beams), count, self._rng
        )
        self._filter = ParticleFilter(particles, self._rng)
        self._is_settled = True

    def _log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        return scan_log_likelihood(map_from_base, beams, self._table, self._config.squash)

    def _wanted_particles(self, estimate: PoseEstimate) -> int:
        tracked = self._is_tracked(estimate)
        return self._config.particles if tracked else self._config.scattered_particles

    @staticmethod
    def _is_tracked(estimate: PoseEstimate) -> bool:
        deviation = np.sqrt(np.trace(estimate.covariance[:2, :2]))
        return bool(estimate.cluster_weight > 0.9 and deviation < _TRACKED_WITHIN)
