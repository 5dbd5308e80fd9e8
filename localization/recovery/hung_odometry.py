"""Decide whether the car stands still or its odometry hangs, when it repeats one pose.

Meanwhile a second track assumes that nothing measures motion: constant velocity from scan to scan, aligned
with the walls each time. When it moves away, scans decide between it and the standing pose.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.motion_source import MotionSource, smoothed_speed
from racecar.localization.odometry.odometry_learning import OdometryLearning
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hypotheses import Hypotheses
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import compared_evidence
from racecar.localization.sensor.end_points import EndPoints, select_points
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose
from racecar.sensors.scan import Scan

_APART = (0.1, 0.05)
"""Metres and radians from the standing pose beyond which scans can decide, since that is some times the error
of either. Chosen by judgement."""
_LEAST_SPEED = 0.1
"""Metres or radians per second below which a better fit does not count, since a car with locked wheels ends
up standing slightly farther on. Chosen by judgement."""
_SCANS_PER_SECOND = 2.0
"""Log-likelihoods counted per second, since errors at one moment are correlated. Chosen by judgement."""
_LARGEST_RATE = 30.0
"""Maximum log-odds per second, so that a third of a second decides in clear cases. Chosen by judgement."""
_WINNING_LOG_ODDS = 10.0
"""Log-odds over a standing car, 20 000 to 1, since discarding right odometry costs more than waiting. Chosen
by judgement."""


class HungOdometry:
    """Tracks the car as if it moved, from when its odometry begins to repeat one pose."""

    def __init__(self, source: MotionSource, learning: OdometryLearning) -> None:
        """Odometry proven to hang is discarded from both arguments."""
        self._source, self._learning = source, learning
        self._rival: MovingRival | None = None

    def follow(self, scan: Scan, step: MotionStep, last: PoseEstimate | None, hypotheses: Hypotheses) -> bool:
        """Whether the car is proven to have moved; the hypothesis then continues there.

        Called with each scan, and the step and the estimate before it.
        """
        rival, is_known = self._rival, hypotheses.believed.is_known
        if last is None or step.is_over_gap or not self._source.samples.repeats(scan.stamp):
            rival = None  # in a gap the car may have been carried, whatever its odometry reports
        elif is_known and (rival is None or rival.has_failed):
            rival = MovingRival(last, self._source.speed)
        self._rival = rival
        if rival is None:
            return False

        def poses_in_sweep(stamps: NDArray[np.int64]) -> Pose:
            return (stamps - scan.stamp)[:, None] * 1e-9 * rival.speed

        points = select_points(scan, hypotheses.config.beams, poses_in_sweep)
        rival.follow(step.seconds, points, hypotheses.perception)
        if not rival.has_won:
            return False
        self._rival = None
        self._learning.leave_out_odometry(scan.stamp, rival.speed)
        hypotheses.continue_at(rival.map_from_base)
        return True


class MovingRival:
    """The track of a moving car whose odometry hangs."""

    def __init__(self, last: PoseEstimate, speed: Pose) -> None:
        """Starts at the last estimate before it, with a velocity (3,) per second."""
        self.map_from_base = self._start = last.map_from_base
        self.speed = speed
        self._covariance = last.covariance
        self._log_odds = 0.0

    def follow(self, seconds: float, points: EndPoints, perception: Perception) -> None:
        """Add a scan ``seconds`` after the last."""
        predicted = compose(self.map_from_base, self.speed * seconds)
        aligned = perception.aligned(predicted, self._covariance, points)
        measured = between(self.map_from_base, aligned) / max(seconds, 1e-3)
        self.speed = smoothed_speed(self.speed, measured, seconds)
        self.map_from_base = aligned
        if not are_apart(aligned, self._start, _APART):
            self._log_odds = 0.0
            return
        moving, stood = perception.log_likelihood(np.stack([aligned, self._start]), points).tolist()
        if moving > stood and np.abs(self.speed).max() < _LEAST_SPEED:
            return
        self._log_odds += compared_evidence(moving - stood, seconds, _SCANS_PER_SECOND, _LARGEST_RATE)

    @property
    def has_won(self) -> bool:
        """Whether the evidence proves that the car moves."""
        return self._log_odds >= _WINNING_LOG_ODDS

    @property
    def has_failed(self) -> bool:
        """Whether the evidence is against this track."""
        return self._log_odds <= -_WINNING_LOG_ODDS
