"""The localizer of a live car: odometry and scans in, poses out."""

from dataclasses import dataclass, replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams, select_beams
from localization.config import LocalizationConfig
from localization.motion_model_kernels import carry
from localization.motion_source import RESTART_SECONDS, MotionSource, MotionStep
from localization.particle_filter import ParticleFilter
from localization.pose_estimate import PoseEstimate
from localization.range_table import build_range_table
from localization.refinement import find_walls, refine
from localization.start_poses import draw_about, draw_anywhere, draw_start, draw_within
from localization.tempering import temper
from localization.weighing import scan_log_likelihood
from maps.occupancy_grid import OccupancyGrid
from maps.odometry import Odometry
from maps.scan import Scan
from maps.se2 import Pose, compose

_NEWS_AFTER = 0.02
"""Metres plus radians of motion after which a scan tells something new. Scans of a car that stands repeat
themselves; counted as independent, they would narrow the cloud to a point."""
_LOST_FIT = -4.5
_LOST_AFTER = 20
"""A good pose on a fair map explains a beam with a mean log-probability of -3.2 to -4; when the best
particle stays below this fit for so many scans, the filter starts over."""
_FAR_ADVANTAGE = np.log(2.0)
"""By how much a far place must fit better than one near the last: each beam twice as probable, on average.
What has changed since the map was made costs nearly as much at the right place, and may not at one alike."""
_FASTEST_DRIVE = 5.0
"""Metres per second that a car goes at most while nothing measures its motion."""
_TRACKED_WITHIN = 0.5
"""Metres of standard deviation within which the place counts as known."""


@dataclass(frozen=True, eq=False)
class _Published:
    """What one scan came to; replaced as a whole, so that readers neither wait nor see two scans mixed."""

    estimate: PoseEstimate
    odom_from_base: Pose | None
    """At the estimate's stamp, where odometry told it."""


class Localizer:
    """Tells the car's pose on a map; its methods may be called from several threads at once.

    `add_odometry`, `pose_at` and `particles` do not wait for a scan that is being worked on.
    """

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
        self._last: PoseEstimate | None = None
        self._published: _Published | None = None
        self._travel_since_weighing = 0.0
        self._scatter()

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None = None) -> None:
        """Start anew about a pose (3,), as widely as its covariance (3, 3) or else the settings say.

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            start = draw_start(map_from_base, covariance, self._table.free_space, self._config, self._rng)
            self._start_from(start)

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew from a point (2,) known to so many metres, facing any way.

        Raises UserError when the car cannot stand there or these are not finite numbers.
        """
        with self._lock:
            self._start_from(
                draw_within(radius, point_in_map, self._table.free_space, self._config, self._rng)
            )

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._scatter()

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from the next scan on; the estimate goes on from where it is.

        Raises UserError when the map does not fit into the settings' memory; then the old ones stay.
        """
        with self._lock:
            if config.table_megabytes != self._config.table_megabytes:
                self._table = build_range_table(self._walls.grid, config.table_megabytes)
            self._config = config
            self._motion.reconfigure(config)

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        self._motion.add(odometry)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            if self._last is not None and 0 <= self._last.stamp - scan.stamp < RESTART_SECONDS * 1e9:
                return replace(self._last, is_start=False)
            step = self._motion.step_to(scan.stamp)
            self._filter.predict(step, self._motion.model)
            if self._is_settled and (step.is_over_gap or self._lost_scans >= _LOST_AFTER):
                self._start_over(step)
            was_settled = self._is_settled
            odometry_at = self._motion.poses_at if self._motion.knows(scan.stamp) else None
            beams = select_beams(scan, self._config.beams, odometry_at)
            if len(beams) > 0 and self._is_news(step):
                self._weigh(beams)
            doubt = min(self._lost_scans / _LOST_AFTER, 1.0)
            estimate = self._filter.estimate(scan.stamp, is_start=not was_settled, lost_probability=doubt)
            if self._is_tracked(estimate):
                estimate = replace(estimate, map_from_base=refine(estimate.map_from_base, beams, self._walls))
            self._filter.resample(min(len(self._filter), self._wanted_particles(estimate)))
            self._motion.follow(scan.stamp, estimate.map_from_base)
            self._last = estimate
            self._published = _Published(estimate, self._motion.odom_from_base)
            self._cloud = self._filter.map_from_base, self._filter.weights
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate carried to a stamp by odometry, its covariance grown; None before any scan."""
        published = self._published
        if published is None:
            return None
        last = published.estimate
        step = self._motion.step_from(published.odom_from_base, last.stamp, stamp)
        map_from_base, covariance = carry(
            last.map_from_base, last.covariance, step.base_from_next_base, step.deviations
        )
        return replace(last, stamp=stamp, map_from_base=map_from_base, covariance=covariance, is_start=False)

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,) that sum to 1, as they were after the last scan or start."""
        map_from_base, weights = self._cloud
        return map_from_base.copy(), weights.copy()

    def _scatter(self) -> None:
        self._start_from(self._anywhere())

    def _start_over(self, step: MotionStep) -> None:
        """Search where the odometry leads or, after a gap in it, where the car can have driven meanwhile.

        The whole map is searched too, for a place that fits far better.
        """
        assert self._last is not None
        predicted = compose(self._last.map_from_base, step.base_from_next_base)
        if step.is_over_gap and np.isinf(step.travel):
            reach = self._table.free_space.within(_FASTEST_DRIVE * step.seconds, predicted[:2])
            nearby = draw_anywhere(reach, self._config, self._rng) if reach.cell_count else self._anywhere()
        else:
            nearby = draw_about(predicted, self._config.scattered_particles, self._config, self._rng)
        self._start_from(nearby, or_anywhere=True)

    def _anywhere(self) -> Pose:
        return draw_anywhere(self._table.free_space, self._config, self._rng)

    def _start_from(self, map_from_base: Pose, or_anywhere: bool = False) -> None:
        """Search among poses (N, 3) and, with ``or_anywhere``, for one elsewhere that fits far better."""
        self._filter = ParticleFilter(map_from_base, self._rng)
        self._cloud = self._filter.map_from_base, self._filter.weights
        self._or_anywhere = or_anywhere
        self._is_settled = False
        self._lost_scans = 0
        self._motion.forget_speed()

    def _is_news(self, step: MotionStep) -> bool:
        self._travel_since_weighing += step.travel
        return not self._is_settled or self._travel_since_weighing >= _NEWS_AFTER

    def _weigh(self, beams: Beams) -> None:
        self._travel_since_weighing = 0.0
        if not self._is_settled:
            self._settle(beams)
            return
        log_likelihood = self._filter.explain(lambda poses: self._log_likelihood(poses, beams))
        self._filter.weigh(log_likelihood)
        self._lost_scans = self._lost_scans + 1 if self._fit(log_likelihood, beams) < _LOST_FIT else 0

    def _settle(self, beams: Beams) -> None:
        """Take in a first scan, for which the cloud is too thin to be weighed at once."""
        particles, fit = self._tempered(self._filter.map_from_base, beams)
        if self._or_anywhere:
            elsewhere, fit_elsewhere = self._tempered(self._anywhere(), beams)
            particles = elsewhere if fit_elsewhere > fit + _FAR_ADVANTAGE else particles
        self._filter = ParticleFilter(particles, self._rng)
        self._is_settled = True

    def _tempered(self, cloud: Pose, beams: Beams) -> tuple[Pose, float]:
        """Particles at the places of a cloud that fit a scan best, and how well they do."""
        count = min(len(cloud), self._config.scattered_particles)
        particles = temper(cloud, lambda poses: self._log_likelihood(poses, beams), count, self._rng)
        return particles, self._fit(self._log_likelihood(particles, beams), beams)

    def _fit(self, log_likelihood: NDArray[np.float64], beams: Beams) -> float:
        """The mean log-probability of a beam at the best particle."""
        return float(log_likelihood.max() * self._config.squash / len(beams))

    def _log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        return scan_log_likelihood(map_from_base, beams, self._table, self._config.squash)

    def _wanted_particles(self, estimate: PoseEstimate) -> int:
        tracked = self._is_tracked(estimate)
        return self._config.particles if tracked else self._config.scattered_particles

    @staticmethod
    def _is_tracked(estimate: PoseEstimate) -> bool:
        deviation = np.sqrt(np.trace(estimate.covariance[:2, :2]))
        return bool(estimate.cluster_weight > 0.9 and deviation < _TRACKED_WITHIN)
