"""A car whose odometry repeats one pose moves or stands, as the scans decide."""

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.hung_odometry import MovingRival
from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import IDENTITY, Pose

LAST = PoseEstimate(0, IDENTITY.copy(), 1e-4 * np.eye(3), 1.0, 100.0, 100, False, 0.0)
PERIOD = 0.1
NOTHING = EndPoints(np.zeros((0, 2)), np.zeros(2))


@dataclass
class PerceptionAt:
    """Of a scan from a true pose that shows it so clearly."""

    true: Pose
    seen: float

    def aligned(self, pose: Pose, _covariance: np.ndarray, _points: EndPoints) -> Pose:
        return self.true if abs(pose[0] - self.true[0]) < 0.3 else pose

    def log_likelihood(self, poses: Pose, _points: EndPoints) -> np.ndarray:
        return -self.seen * np.minimum(np.abs(poses[:, 0] - self.true[0]), 0.5) * 100.0


def rival_after(scans: int, speed: float, true_speed: float, seen: float = 1.0) -> MovingRival:
    """Each scan shows the place with so many centimetres, and so clearly as is ``seen``."""
    rival = MovingRival(LAST, np.array([speed, 0.0, 0.0]))
    for number in range(1, scans + 1):
        true = np.array([true_speed * number * PERIOD, 0.0, 0.0])

        rival.follow(PERIOD, NOTHING, cast("Perception", PerceptionAt(true, seen)))
    return rival


@pytest.mark.parametrize(("speed", "true_speed"), [(2.0, 2.0), (0.0, 0.3), (2.0, 1.0), (-1.0, -1.0)])
def test_one_that_moves_wins(speed: float, true_speed: float) -> None:
    rival = rival_after(20, speed, true_speed)
    assert rival.has_won
    assert rival.speed[0] == pytest.approx(true_speed, abs=0.05)


@pytest.mark.parametrize("speed", [0.0, 0.5, 5.0])
def test_one_that_stands_does_not(speed: float) -> None:
    assert not rival_after(50, speed, 0.0).has_won


def test_where_scans_do_not_tell_nothing_is_decided() -> None:
    rival = rival_after(50, 2.0, 2.0, seen=0.0)
    assert not rival.has_won
    assert not rival.has_failed


def test_one_scan_does_not_decide() -> None:
    assert not rival_after(1, 2.0, 2.0, seen=100.0).has_won
