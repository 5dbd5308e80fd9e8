"""The localizer of a live car: odometry and scans in, poses out."""

from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.start_poses import draw_about, draw_start, region_about
from racecar.localization.floor.region import ANYWHERE
from racecar.localization.odometry.calibration import OdometryFaults
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.odometry_learning import OdometryLearning
from racecar.localization.odometry.published_pose import PublishedPose, publish
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hung_odometry import HungOdometry
from racecar.localization.recovery.hypotheses import Hypotheses
from racecar.localization.recovery.surveyed_map import survey, survey_settings
from racecar.localization.sensor.beams import select_beams
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.frozen_odometry import FrozenOdometry
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.maps.sensing.turn_fusion import TurnModel
from racecar.maps.sensing.yaw_rate import YawRate


class Localizer:
    """Estimates the car's pose on a map; its methods may be called from several threads at once.

    `add_odometry`, `add_yaw_rate`, `pose_at` and `particles` do not wait for a scan that is being worked on.
    """

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Builds the map's range table, which takes a second or two on a large map.

        Raises UserError when the map has no free space or no walls, or seems to have one for the other.
        """
        self._rng, self._config, self._lock = rng, config, Lock()
        self._map = survey(grid, config)
        self._motion = MotionSource(config)
        self._learning = OdometryLearning(self._motion, config)
        self._hung = HungOdometry(self._motion, self._learning)
        self._hypotheses = Hypotheses(self._map, config, rng)
        self._last: PoseEstimate | None = None
        self._published: PublishedPose | None = None
        self._show_particles()

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None = None) -> None:
        """Start anew about a pose (3,), spread by its covariance (3, 3) or else by the settings.

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            start = draw_start(map_from_base, covariance, self._map.free_space, self._config, self._rng)
            self._hypotheses.start_from(start)
            self._learning.start_anew()
            self._show_particles()

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew from anywhere within a radius (metres) of a point (2,), facing any way.

        Raises UserError when the car cannot stand there, or a number is not finite.
        """
        with self._lock:
            self._hypotheses.start_in(region_about(point_in_map, radius, self._map.free_space))
            self._learning.start_anew()
            self._show_particles()

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._hypotheses.start_in(ANYWHERE)
            self._learning.start_anew()
            self._show_particles()

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from the next scan on; the estimate goes on from where it is.

        Where the range table may take another amount of memory, it is built anew.
        """
        with self._lock:
            if survey_settings(config) != survey_settings(self._config):
                self._map = survey(self._map.walls.grid, config)
            self._config = config
            self._hypotheses.reconfigure(self._map, config)
            self._motion.reconfigure(config)
            self._learning.reconfigure(config)

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        self._motion.add(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take in a sample of a gyroscope; those out of order are left out."""
        self._motion.add_yaw_rate(yaw_rate)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            if self._last is not None and self._motion.is_out_of_order(scan.stamp):
                return replace(self._last, is_start=False)
            step = self._motion.step_to(scan.stamp)
            self._predict(step)
            is_start = not self._hypotheses.is_started
            beams = select_beams(scan, self._config.beams, self._motion.poses_in_sweep)
            self._hypotheses.weigh(beams)
            is_start = self._goes_on_elsewhere(scan, step) or is_start
            estimate = self._hypotheses.contest(beams, scan.stamp, step.seconds, is_start)
            if estimate.is_start and not is_start:
                self._learning.start_anew()
            self._hypotheses.resample()
            believed = self._hypotheses.believed
            self._learning.follow(step, believed.particles.lag, estimate, believed.is_trusted)
            self._last, self._published = estimate, publish(estimate, self._motion)
            self._show_particles()
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate carried to a stamp by odometry, its covariance grown; None before any scan."""
        published = self._published
        return None if published is None else published.carried_to(stamp, self._motion)

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,) that sum to 1, as they were after the last scan or start."""
        map_from_base, weights = self._shown
        return map_from_base.copy(), weights.copy()

    @property
    def odometry_faults(self) -> OdometryFaults:
        """What this car's odometry always gets wrong, as learned so far; all motion is corrected by it."""
        return self._motion.calibration.faults

    @property
    def frozen_odometry(self) -> FrozenOdometry:
        """When the odometry repeated a pose while the car moved on."""
        return self._motion.frozen

    @property
    def turn_model(self) -> TurnModel:
        """What the turns by wheels and gyroscope have proven to be worth so far."""
        return self._motion.turns.model

    def _predict(self, step: MotionStep) -> None:
        """Move the particles; after a gap, start over where the odometry leads."""
        if self._last is not None and self._hypotheses.is_started and step.is_over_gap:
            predicted = compose(self._last.map_from_base, step.base_from_next_base)
            start = draw_about(predicted, self._config.particles, self._config, self._rng)
            self._hypotheses.start_from(start)
            self._learning.start_anew()
        else:
            self._hypotheses.predict(step, self._learning.slip_scale)

    def _goes_on_elsewhere(self, scan: Scan, step: MotionStep) -> bool:
        """Whether the car has moved on while its odometry hung."""
        hypotheses = self._hypotheses
        is_narrow = hypotheses.believed.is_narrow
        gone_to = self._hung.follow(scan, step, self._last, is_narrow, hypotheses.perception)
        if gone_to is None:
            return False
        noise = self._rng.standard_normal((self._config.particles, 3))
        hypotheses.go_on_from(gone_to + hypotheses.pushed * noise)
        return True

    def _show_particles(self) -> None:
        particles = self._hypotheses.believed.particles
        self._shown = particles.map_from_base, particles.weights
