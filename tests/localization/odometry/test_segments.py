import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments import OdometryStretch, OdometryStretches
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse

START = np.array([3.0, -1.0, 2.0])
COVARIANCE = np.diag([0.01, 0.03, 0.05]) ** 2


def estimate_at(map_from_base: Pose) -> PoseEstimate:
    return PoseEstimate(0, map_from_base, COVARIANCE, 1.0, 1000.0, 1000, False, 0.0)


def driven(told: Pose, truth: Pose, count: int, lag: float = 0.0, behind: Pose = IDENTITY) -> OdometryStretch:
    """So many steps, of which odometry tells one thing and the estimates another."""
    stretches, map_from_base = OdometryStretches(), START
    step = MotionStep(told, np.zeros(3), 0.1, 0.05, effort=np.array([0.5, 0.25]), behind=behind)
    assert stretches.follow(step, lag, estimate_at(START)) is None
    for number in range(count):
        map_from_base = compose(map_from_base, truth)
        is_known = number == count - 1
        stretch = stretches.follow(step, lag, estimate_at(map_from_base) if is_known else None)
        assert is_known or stretch is None
    assert stretch is not None
    return stretch


increments = st.tuples(st.floats(0.05, 0.1), st.floats(-0.02, 0.02), st.floats(-0.05, 0.05)).map(np.array)


@settings(deadline=None)
@given(increments, st.tuples(*3 * [st.floats(-0.01, 0.01)]))
def test_faults_explain_the_error(told: Pose, faults: tuple[float, float, float]) -> None:
    way, turn, trim = faults
    truth = np.array([(1 + way) * told[0], (1 + way) * told[1], (1 + turn) * told[2] + trim * told[0]])
    stretch = driven(told, truth, 20)
    np.testing.assert_allclose(stretch.by_faults @ faults, stretch.error, atol=1e-3)


def test_it_knows_what_was_driven() -> None:
    stretch = driven(np.array([0.1, 0.0, -0.02]), np.array([0.1, 0.0, -0.02]), 20)
    assert stretch.path == pytest.approx(2.0)
    assert stretch.turn == pytest.approx(0.4)
    assert stretch.way == pytest.approx(2.4)
    assert stretch.pushed_path == pytest.approx(1.0)
    assert stretch.pushed_turn == pytest.approx(0.1)
    np.testing.assert_allclose(stretch.begin_variances, [0.0005, 0.0025])
    np.testing.assert_allclose(stretch.error, 0.0, atol=1e-12)


def test_a_car_that_is_behind_is_where_the_lag_says() -> None:
    told, behind = np.array([0.1, 0.0, 0.0]), np.array([-0.01, 0.0, 0.0])
    stretch = driven(told, np.array([0.085, 0.0, 0.0]), 20, lag=1.5, behind=behind)
    np.testing.assert_allclose(stretch.error, 0.0, atol=1e-12)


@pytest.mark.parametrize("unknown", [9, 31])
def test_a_stretch_is_neither_short_nor_long(unknown: int) -> None:
    """In steps of a tenth of a metre."""
    stretches = OdometryStretches()
    step = MotionStep(np.array([0.1, 0.0, 0.0]), np.zeros(3), 0.1, 0.05)
    stretches.follow(step, 0.0, estimate_at(START))
    for _ in range(unknown - 1):
        assert stretches.follow(step, 0.0, None) is None
    assert stretches.follow(step, 0.0, estimate_at(START)) is None


def test_nothing_is_compared_over_a_new_start_or_where_nothing_measures_the_way() -> None:
    step = MotionStep(np.array([1.5, 0.0, 0.0]), np.zeros(3), 1.5, 0.5)
    unmeasured = MotionStep(np.array([1.5, 0.0, 0.0]), np.zeros(3), np.inf, 0.5)
    elsewhere = compose(START, inverse(np.array([9.0, 0.0, 0.0])))
    stretches = OdometryStretches()
    stretches.follow(step, 0.0, estimate_at(START))
    assert stretches.follow(step, 0.0, estimate_at(START)) is not None
    stretches.start_anew()
    assert stretches.follow(step, 0.0, estimate_at(elsewhere)) is None
    assert stretches.follow(unmeasured, 0.0, estimate_at(START)) is None
    assert stretches.follow(step, 0.0, estimate_at(START)) is None
