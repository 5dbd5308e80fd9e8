"""Noticing that odometry which repeats one pose hangs, while the car goes on."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.odometry_learning import OdometryLearning
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hypotheses import Hypotheses
from racecar.localization.recovery.moving_rival import MovingRival
from racecar.localization.sensor.beams import select_beams
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.scan import Scan


class HungOdometry:
    """Follows the car as if it moved, from when its odometry begins to repeat one pose."""

    def __init__(self, source: MotionSource, learning: OdometryLearning) -> None:
        """Odometry that has proven to hang is left out from both."""
        self._source, self._learning = source, learning
        self._rival: MovingRival | None = None

    def follow(self, scan: Scan, step: MotionStep, last: PoseEstimate | None, hypotheses: Hypotheses) -> bool:
        """Whether the car is proven to have moved on; what is believed then goes on from there.

        Scans come with the step and the estimate before them.
        """
        rival, perception, is_known = self._rival, hypotheses.perception, hypotheses.believed.is_known
        if last is None or step.is_over_gap or not self._source.repeats(scan.stamp):
            rival = None  # in a gap the car may have been carried, whatever its odometry does
        elif is_known and (rival is None or rival.has_failed):
            rival = MovingRival(last, self._source.speed)
        self._rival = rival
        if rival is None:
            return False

        def poses_in_sweep(stamps: NDArray[np.int64]) -> Pose:
            return (stamps - scan.stamp)[:, None] * 1e-9 * rival.speed

        beams = select_beams(scan, hypotheses.config.beams, poses_in_sweep)
        rival.follow(
            step.seconds,
            lambda pose, covariance: perception.aligned(pose, covariance, beams),
            lambda poses: perception.log_likelihood(poses, beams),
        )
        if not rival.has_won:
            return False
        self._rival = None
        self._learning.leave_out_odometry(scan.stamp, rival.speed)
        hypotheses.go_on_about(rival.map_from_base)
        return True
