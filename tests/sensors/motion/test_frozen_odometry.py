"""When odometry repeated a pose while the car drove on."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.odometry import Odometry

SECOND = 1_000_000_000
POSE = np.array([1.0, 2.0, 0.5])
START = 100 * SECOND


def frozen(moved: float) -> FrozenOdometry:
    """From second 5 to second 7."""
    odometry = FrozenOdometry()
    odometry.freeze(START + 5 * SECOND, POSE)
    for second in (6, 7):
        odometry.follow(START + second * SECOND, np.array([0.5 * moved, 0.0, 0.0]))
    return odometry


def test_it_lasts_until_the_pose_changes() -> None:
    odometry = frozen(1.0)
    assert not odometry.thaws_with(Odometry(START + 8 * SECOND, POSE.copy(), IDENTITY))
    assert odometry.is_frozen_at(START + 20 * SECOND)
    assert odometry.thaws_with(Odometry(START + 9 * SECOND, POSE + 1e-9, IDENTITY))
    assert odometry.is_frozen_at(START + 9 * SECOND - 1)  # scans may come after odometry of their sweep's end
    assert not odometry.is_frozen_at(START + 9 * SECOND)
    odometry.follow(START + 10 * SECOND, np.array([1.0, 0.0, 0.0]))  # not part of it any more
    assert "5.0 to 9.0 s" in str(odometry.warning(START))


def test_what_is_not_frozen_may_go_on() -> None:
    odometry = FrozenOdometry()
    odometry.freeze(START, np.array([np.nan, np.nan, 0.5]))
    assert not odometry.thaws_with(Odometry(START + SECOND, np.array([1.0, 2.0, 0.5]), IDENTITY))
    assert odometry.is_frozen_at(START + SECOND)
    assert odometry.thaws_with(Odometry(START + SECOND, np.array([1.0, 2.0, 0.6]), IDENTITY))


@pytest.mark.parametrize(("moved", "is_told"), [(0.3, False), (2.0, True)])
def test_only_what_a_stop_cannot_explain_is_told(moved: float, is_told: bool) -> None:
    assert (frozen(moved).warning(START) is not None) == is_told


def test_a_robot_that_was_carried_is_not_told_that_its_driver_hung() -> None:
    assert "If the robot was carried, no action is needed" in str(frozen(2.0).warning(START))
