"""What the estimates say of the car's motion: its speed, and while its place is known how odometry is off."""

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
"""Metres, or radians, beyond what wheels slip, from which on the estimate jumped, as along a corridor to
where scans fit as well, since a place that is known is known to so much."""


class OdometryLearning:
    """Compares the path that odometry reports with that of the estimates."""

    def __init__(self, source: MotionSource) -> None:
        """The source's odometry is corrected by what is learned."""
        self._source = source
        self._segments = OdometrySegments()
        self._trust = OdometryTrust()
        self._last: PoseEstimate | None = None
        self._was_known = False
        """Whether the place of the last estimate was known, and it was no start."""

    @property
    def slip_scale(self) -> NDArray[np.float64]:
        """(2,) what share of the settings' slip this car's distances and turns deserve, 0 to 1."""
        return self._trust.slip_scale(self._source.config.slip)

    def start_anew(self) -> None:
        """The estimates to come do not continue those before: the car did not move by what lies between."""
        self._source.start_anew()
        self._segments.start_anew()
        self._last = None

    def leave_out_odometry(self, stamp: int, speed: Pose) -> None:
        """What the odometry repeats at a stamp is no motion, and not held against it as such.

        The car goes on at a speed (3,) per second.
        """
        self.start_anew()
        samples = self._source.samples
        samples.leave_out_odometry(samples.repeats_since(stamp))
        self._source.speed = speed

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate, is_known: bool) -> None:
        """Take in the estimate after a step, which counts against odometry where the place is known well."""
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
