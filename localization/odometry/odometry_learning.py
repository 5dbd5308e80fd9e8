"""What the estimates say of the car's motion: its speed, and while its place is known how odometry is off."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments import OdometrySegments
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, are_apart, compose

_JUMP = 0.25
"""Metres, or radians, beyond what wheels slip, from which on the estimate jumped, as along a corridor to
where scans fit as well, since a place that is known is known to so much."""


class OdometryLearning:
    """Compares the path that odometry reports with that of the estimates."""

    def __init__(self, source: MotionSource, config: LocalizationConfig) -> None:
        """The source's odometry is corrected by what is learned."""
        self._source = source
        self._segments = OdometrySegments()
        self._trust = OdometryTrust()
        self._slip = config.slip
        self._last: PoseEstimate | None = None

    def reconfigure(self, config: LocalizationConfig) -> None:
        """Take other settings from here on."""
        self._slip = config.slip

    @property
    def slip_scale(self) -> NDArray[np.float64]:
        """(2,) what share of the settings' slip this car's distances and turns deserve, 0 to 1."""
        return self._trust.slip_scale(self._slip)

    def start_anew(self) -> None:
        """The estimates to come do not continue those before: the car did not move by what lies between."""
        self._source.forget_speed()
        self._segments.start_anew()
        self._last = None

    def leave_out_odometry(self, stamp: int, speed: Pose) -> None:
        """What the odometry repeats at a stamp is no motion, and not held against it as such.

        The car goes on at a speed (3,) per second.
        """
        self._source.leave_out_odometry(stamp, speed)
        self._segments.start_anew()

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate, is_known: bool) -> None:
        """Take in the estimate after a step, which counts against odometry where the place is known well."""
        if self._last is not None and self._jumps(self._last, step, estimate):
            self.start_anew()
        self._last = estimate
        continues = is_known and not estimate.is_start
        self._source.learn_turn(estimate.map_from_base if continues else None)
        segment = self._segments.follow(step, lag, estimate if is_known else None)
        if segment is not None:
            self._trust.learn(segment, self._slip)
            self._source.calibration.learn(segment, self._slip)
        self._source.follow(estimate.stamp, estimate.map_from_base)

    def _jumps(self, last: PoseEstimate, step: MotionStep, estimate: PoseEstimate) -> bool:
        """Whether an estimate is elsewhere than any motion led that the step may have been."""
        expected = compose(last.map_from_base, step.base_from_next_base)
        most = _JUMP + self._slip * step.travel
        return are_apart(expected, estimate.map_from_base, (most, most))
