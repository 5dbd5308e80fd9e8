"""The localizer: odometry and scans in, poses out; the method is in `Localizer.add_scan`."""

from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import ANYWHERE
from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.motion_model import carry
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.odometry_learning import OdometryLearning
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hung_odometry import HungOdometry
from racecar.localization.recovery.hypotheses import Hypotheses
from racecar.localization.sensor.end_points import select_points
from racecar.maps.calls import checked
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.sensors.motion.motion_samples import OdometryReading, is_set_back
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.motion.turn_fusion import TurnModel
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_DEFAULTS = LocalizationConfig()


class Localizer:
    """Estimates the car's pose on a map; thread-safe.

    `add_odometry`, `add_yaw_rate`, `pose_at` and `particles` do not wait for a scan in progress.
    """

    @checked
    def __init__(
        self,
        grid: OccupancyGrid,
        config: LocalizationConfig = _DEFAULTS,
        rng: np.random.Generator | None = None,
    ) -> None:
        """Analyzes the map, which takes a moment if it is large. Without ``rng``, the same inputs give the
        same poses, as with ``numpy.random.default_rng(0)``.

        Raises UserError when the map has no free space or no walls, or seems to be inverted.
        """
        self._config, self._lock = config, Lock()
        self._motion = MotionSource(config)
        self._samples = self._motion.samples
        self._learning = OdometryLearning(self._motion)
        self._hypotheses = Hypotheses(grid, config, np.random.default_rng(0) if rng is None else rng)
        self._hung = HungOdometry(self._motion, self._learning)
        self._published: tuple[PoseEstimate, OdometryReading, OdometryFaults] | None = None
        """Replaced atomically with each scan, so that readers neither wait nor see a mix of two scans."""
        self.frozen_odometry = self._samples.frozen
        """When the odometry repeated a pose while the car moved on."""

    @checked
    def set_pose(self, map_from_base: ArrayLike, covariance: ArrayLike | None = None) -> None:
        """Restart at a pose (3,), with its covariance (3, 3) or the default one.

        Raises UserError when it is not finite, off the map or far from free space.
        """
        with self._lock:
            self._hypotheses.start_at(map_from_base, covariance)
            self._learning.start_anew()

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Restart within a radius (metres) of a point (2,), at any heading.

        Raises UserError when the car cannot stand there, or a number is not finite.
        """
        with self._lock:
            self._hypotheses.start_within(point_in_map, radius)
            self._learning.start_anew()

    def scatter(self) -> None:
        """Restart anywhere on the map."""
        with self._lock:
            self._hypotheses.start_in(ANYWHERE)
            self._learning.start_anew()

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Apply other settings from the next scan on; the estimate continues."""
        with self._lock:
            self._config = self._hypotheses.config = self._motion.config = config

    @checked
    def add_odometry(self, odometry: Odometry) -> None:
        """Add an odometry sample; those out of order are ignored."""
        self._samples.add_odometry(odometry)

    @checked
    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample; those out of order are ignored."""
        self._samples.add_yaw_rate(yaw_rate)

    @checked
    def add_scan(self, scan: Scan) -> PoseEstimate:
        """Process a scan and return the pose at its stamp; out of order, return the last scan's pose."""
        with self._lock:
            hypotheses = self._hypotheses
            last = None if self._published is None else self._published[0]
            if last is not None and scan.stamp <= last.stamp and not is_set_back(last.stamp, scan.stamp):
                return replace(last, is_start=False)

            # Predict: move particles by odometry; after a gap they restart where it leads.
            step = self._motion.step_to(scan.stamp)
            scan = self._motion.calibration.turned(scan)
            if last is not None and hypotheses.is_started and step.is_over_gap:
                hypotheses.start_about(compose(last.map_from_base, step.base_from_next_base))
                self._learning.start_anew()
            else:
                hypotheses.predict(step, self._learning.slip_scale)
            is_start = not hypotheses.is_started

            # Weight: the first scan selects places; later ones count where the map explains them.
            points = select_points(scan, self._config.beams, self._motion.poses_in_sweep)
            hypotheses.weigh(points)
            went_on = self._hung.follow(scan, step, last, hypotheses)

            # Estimate and compare: the current hypothesis gives the pose until scans confirm another one that
            # the car cannot have driven to.
            believed = hypotheses.estimate(points, scan.stamp, step.seconds, is_start or went_on)
            estimate = hypotheses.contest(believed, points, step.seconds)
            if estimate.is_start and not believed.is_start:
                self._learning.start_anew()

            # Resample, and calibrate the odometry by the estimate.
            hypotheses.resample()
            winner = hypotheses.believed
            self._learning.follow(step, winner.particles.lag, estimate, winner.is_known)
            self._published = estimate, self._motion.reading, self.calibration.faults
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate propagated to a stamp by odometry, with its covariance; None before any scan."""
        published = self._published
        if published is None:
            return None
        estimate, reading, faults = published
        step = self._motion.step_from(reading, faults, stamp)
        map_from_base, covariance = carry(
            estimate.map_from_base, estimate.covariance, step.base_from_next_base, step.deviations
        )
        return replace(
            estimate, stamp=stamp, map_from_base=map_from_base, covariance=covariance, is_start=False
        )

    def points_in_base(self, scan: Scan) -> NDArray[np.float64]:
        """(M, 2) end points of the scan that was added last, in the base frame at its stamp, corrected for
        the motion during the sweep and for the learned yaw of the laser."""
        turned = self._motion.calibration.turned(scan)
        return select_points(turned, len(turned.ranges), self._motion.poses_in_sweep).in_base

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,) with sum 1, after the last scan or restart."""
        map_from_base, weights = self._hypotheses.shown
        return map_from_base.copy(), weights.copy()

    @property
    def calibration(self) -> OdometryCalibration:
        """Learned systematic errors of the odometry and of the laser's yaw.

        They correct all motion and all scans.
        """
        return self._motion.calibration

    @property
    def turn_model(self) -> TurnModel:
        """Learned errors of the turns by wheels and gyroscope."""
        return self._motion.turns.model
