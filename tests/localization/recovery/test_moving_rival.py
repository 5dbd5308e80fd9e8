"""A car whose odometry repeats one pose moves or stands, as the scans decide."""

import numpy as np
import pytest

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.moving_rival import MovingRival
from racecar.maps.geometry.se2 import IDENTITY, Pose

LAST = PoseEstimate(0, IDENTITY.copy(), 1e-4 * np.eye(3), 1.0, 100.0, 100, False, 0.0)
PERIOD = 0.1


def rival_after(scans: int, speed: float, true_speed: float, seen: float = 1.0) -> MovingRival:
    """Each scan shows the place with so many centimetres, and so clearly as is ``seen``."""
    rival = MovingRival(LAST, np.array([speed, 0.0, 0.0]))
    for number in range(1, scans + 1):
        true = np.array([true_speed * number * PERIOD, 0.0, 0.0])

        def align(pose: Pose, covariance: np.ndarray, true: Pose = true) -> Pose:
            return true if abs(pose[0] - true[0]) < 0.3 else pose

        def log_likelihood(poses: Pose, true: Pose = true) -> np.ndarray:
            return -seen * np.minimum(np.abs(poses[:, 0] - true[0]), 0.5) * 100.0

        rival.follow(PERIOD, align, log_likelihood)
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
