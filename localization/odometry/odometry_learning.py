"""Learns the car's speed from the estimates, and its odometry's errors while its pose is well known."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.segments import OdometrySegments
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, are_apart
from racecar.maps.geometry.se2_kernels import step_between

_JUMP = 0.25
"""Metres or radians, in addition to wheel slip, above which the estimate counts as a jump, for example along
a corridor to where scans fit as well, since a known pose is more precise than that."""


class OdometryLearning:
    """Compares the path of the odometry with that of the estimates."""

    def __init__(self, source: MotionSource) -> None:
        """What is learned corrects the source's odometry."""
        self._source = source
        self._segments = OdometrySegments()
        self._trust = OdometryTrust()
        self._last: PoseEstimate | None = None
        self._was_known = False
        """Whether the last estimate's pose was well known, and was not a start."""

    @property
    def slip_scale(self) -> NDArray[np.float64]:
        """(2,) share of the configured slip that applies to this car's distances and turns, 0 to 1."""
        return self._trust.slip_scale(self._source.config.slip)

    def start_anew(self) -> None:
        """Restart: the next estimates do not continue the previous ones; the car did not move in between."""
        self._source.start_anew()
        self._segments.start_anew()
        self._last = None

    def leave_out_odometry(self, stamp: int, speed: Pose) -> None:
        """Ignore the pose that odometry repeats at a stamp, without counting it as an error.

        The car continues at a speed (3,) per second.
        """
        self.start_anew()
        samples = self._source.samples
        samples.leave_out_odometry(samples.repeats_since(stamp))
        self._source.speed = speed

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate, is_known: bool) -> None:
        """Add the estimate after a step; it is compared with odometry where the pose is well known."""
        slip = self._source.config.slip
        if self._last is not None:
            moved = step_between(self._last.map_from_base, estimate.map_from_base)
            most = _JUMP + slip * step.travel
            if are_apart(step.base_from_next_base, moved, (most, most)):
                self.start_anew()
            else:
                self._source.learn(moved, is_known and self._was_known)
        self._last, self._was_known = estimate, is_known and not estimate.is_start
        segment = self._segments.follow(step, lag, estimate if is_known else None)
        if segment is not None:
            self._trust.learn(segment, slip)
            self._source.calibration.learn(segment, slip)
