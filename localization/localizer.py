"""The localizer of a live car: odometry and scans in, poses out; the method is `Localizer.add_scan`."""

from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import ANYWHERE
from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.motion_model import carry
from racecar.localization.odometry.motion_samples import MotionSamples, OdometryReading, is_set_back
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.odometry_learning import OdometryLearning
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hung_odometry import HungOdometry
from racecar.localization.recovery.hypotheses import Hypotheses
from racecar.localization.sensor.end_points import select_points
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.motion.turn_fusion import TurnModel
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate


class Localizer:
    """Estimates the car's pose on a map; its methods may be called from several threads at once.

    `add_odometry`, `add_yaw_rate`, `pose_at` and `particles` do not wait for a scan that is being worked on.
    """

    def __init__(self, grid: OccupancyGrid, config: LocalizationConfig, rng: np.random.Generator) -> None:
        """Surveys the map, which takes a moment on a large one.

        Raises UserError when the map has no free space or no walls, or seems to have one for the other.
        """
        self._config, self._lock = config, Lock()
        self._samples = MotionSamples()
        self._motion = MotionSource(self._samples, config)
        self._learning = OdometryLearning(self._motion)
        self._hypotheses = Hypotheses(grid, config, rng)
        self._hung = HungOdometry(self._motion, self._learning)
        self._published: tuple[PoseEstimate, OdometryReading, OdometryFaults] | None = None
        """Replaced as a whole by the next scan's, so that readers neither wait nor see two scans mixed."""
        self.frozen_odometry = self._samples.frozen
        """When the odometry repeated a pose while the car moved on."""

    def set_pose(self, map_from_base: Pose, covariance: NDArray[np.float64] | None = None) -> None:
        """Start anew about a pose (3,), spread by its covariance (3, 3) or else by the settings.

        Raises UserError when it is not finite, off the map or far from any place where the car can stand.
        """
        with self._lock:
            self._hypotheses.start_at(map_from_base, covariance)
            self._learning.start_anew()

    def set_position(self, point_in_map: NDArray[np.float64], radius: float) -> None:
        """Start anew from anywhere within a radius (metres) of a point (2,), facing any way.

        Raises UserError when the car cannot stand there, or a number is not finite.
        """
        with self._lock:
            self._hypotheses.start_within(point_in_map, radius)
            self._learning.start_anew()

    def scatter(self) -> None:
        """Start anew from anywhere on the map."""
        with self._lock:
            self._hypotheses.start_in(ANYWHERE)
            self._learning.start_anew()

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from the next scan on; the estimate goes on from where it is."""
        with self._lock:
            self._config = self._hypotheses.config = self._motion.config = config

    def add_odometry(self, odometry: Odometry) -> None:
        """Take in a sample of odometry; those out of order are left out."""
        self._samples.add_odometry(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take in a sample of a gyroscope; those out of order are left out."""
        self._samples.add_yaw_rate(yaw_rate)

    def add_scan(self, scan: Scan) -> PoseEstimate:
        """The pose at a scan's stamp; a scan out of order gives the last scan's pose again."""
        with self._lock:
            hypotheses = self._hypotheses
            last = None if self._published is None else self._published[0]
            if last is not None and scan.stamp <= last.stamp and not is_set_back(last.stamp, scan.stamp):
                return replace(last, is_start=False)

            # Predict: particles move as odometry measured; after a gap they start over where it leads.
            step = self._motion.step_to(scan.stamp)
            scan = self._motion.calibration.turned(scan)
            if last is not None and hypotheses.is_started and step.is_over_gap:
                hypotheses.start_about(compose(last.map_from_base, step.base_from_next_base))
                self._learning.start_anew()
            else:
                hypotheses.predict(step, self._learning.slip_scale)
            is_start = not hypotheses.is_started

            # Explain and weigh: the first scan chooses places, of later ones counts what the map explains.
            points = select_points(scan, self._config.beams, self._motion.poses_in_sweep)
            hypotheses.weigh(points)
            went_on = self._hung.follow(scan, step, last, hypotheses)

            # Estimate and contest: the hypothesis that is believed says where the car is, until scans
            # confirm another one, to whose place the car did not drive from the last.
            believed = hypotheses.estimate(points, scan.stamp, step.seconds, is_start or went_on)
            estimate = hypotheses.contest(believed, points, step.seconds)
            if estimate.is_start and not believed.is_start:
                self._learning.start_anew()

            # Resample, and learn from the estimate how odometry measures.
            hypotheses.resample()
            winner = hypotheses.believed
            self._learning.follow(step, winner.particles.lag, estimate, winner.is_known)
            self._published = estimate, self._motion.reading, self.calibration.faults
            return estimate

    def pose_at(self, stamp: int) -> PoseEstimate | None:
        """The last estimate carried to a stamp by odometry, its covariance grown; None before any scan."""
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

    def particles(self) -> tuple[Pose, NDArray[np.float64]]:
        """Poses (N, 3) and weights (N,) that sum to 1, as they were after the last scan or start."""
        map_from_base, weights = self._hypotheses.shown
        return map_from_base.copy(), weights.copy()

    @property
    def calibration(self) -> OdometryCalibration:
        """What this car's odometry always gets wrong and how its laser is turned, as learned so far.

        All motion is corrected by the one, all scans by the other.
        """
        return self._motion.calibration

    @property
    def turn_model(self) -> TurnModel:
        """What the turns by wheels and gyroscope have proven to be worth so far."""
        return self._motion.turns.model
