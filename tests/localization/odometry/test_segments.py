import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.segments import OdometrySegment, OdometrySegments
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse

START = np.array([3.0, -1.0, 2.0])
COVARIANCE = np.diag([0.01, 0.03, 0.05]) ** 2


def estimate_at(map_from_base: Pose) -> PoseEstimate:
    return PoseEstimate(0, map_from_base, COVARIANCE, 1.0, 1000.0, 1000, False, 0.0)


def driven(told: Pose, truth: Pose, count: int, lag: float = 0.0, behind: Pose = IDENTITY) -> OdometrySegment:
    """So many steps, of which odometry says one thing and the estimates another."""
    segments, map_from_base = OdometrySegments(), START
    step = MotionStep(told, np.zeros(3), 0.1, 0.05, effort=np.array([0.5, 0.25]), behind=behind)
    assert segments.follow(step, lag, estimate_at(START)) is None
    for number in range(count):
        map_from_base = compose(map_from_base, truth)
        is_known = number == count - 1
        segment = segments.follow(step, lag, estimate_at(map_from_base) if is_known else None)
        assert is_known or segment is None
    assert segment is not None
    return segment


increments = st.tuples(st.floats(0.05, 0.09), st.floats(-0.02, 0.02), st.floats(-0.05, 0.05)).map(
    lambda increment: np.array(increment) + 0.0  # no minus zero, whose sign is lost where a lag is added
)
"""Twenty of them are shorter than the longest segment, with which another would begin."""


@given(increments, st.tuples(*5 * [st.floats(-0.01, 0.01)]))
def test_faults_explain_the_error(told: Pose, faults: tuple[float, ...]) -> None:
    """At a quarter of the effort across."""
    distance, turn, trim, laser_turn, side_slip = faults
    x, y = (1 + distance) * told[0], (1 + distance) * told[1]
    aside = np.copysign(0.25, told[2]) * side_slip * x - laser_turn * x
    truth = np.array([x + laser_turn * y, y + aside, (1 + turn) * told[2] + trim * told[0]])
    segment = driven(told, truth, 20)
    np.testing.assert_allclose(segment.by_faults @ faults, segment.error, atol=1e-3)


def test_it_knows_what_was_driven() -> None:
    segment = driven(np.array([0.1, 0.0, -0.02]), np.array([0.1, 0.0, -0.02]), 20)
    assert segment.driven == pytest.approx([2.0, 0.4])
    assert segment.travel == pytest.approx(2.4)
    assert segment.pushed == pytest.approx([1.0, 0.1])
    np.testing.assert_allclose(segment.error, 0.0, atol=1e-12)


def test_it_ends_less_surely_aside_the_less_sure_the_heading_at_its_beginning() -> None:
    segment = driven(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), 20)
    turned = np.array([[np.cos(2.0), np.sin(2.0)], [-np.sin(2.0), np.cos(2.0)]])
    place = 2.0 * turned @ COVARIANCE[:2, :2] @ turned.T + np.diag([0.0, 2.0**2 * COVARIANCE[2, 2]])
    np.testing.assert_allclose(segment.covariance[:2, :2], place, atol=1e-12)
    assert segment.covariance[2, 2] == pytest.approx(2.0 * COVARIANCE[2, 2])


def test_a_car_that_is_behind_is_where_the_lag_says() -> None:
    told, behind = np.array([0.1, 0.0, 0.0]), np.array([-0.01, 0.0, 0.0])
    segment = driven(told, np.array([0.085, 0.0, 0.0]), 20, lag=1.5, behind=behind)
    np.testing.assert_allclose(segment.error, 0.0, atol=1e-12)


@pytest.mark.parametrize("unknown", [9, 31])
def test_a_segment_is_neither_short_nor_long(unknown: int) -> None:
    """In steps of a tenth of a metre."""
    segments = OdometrySegments()
    step = MotionStep(np.array([0.1, 0.0, 0.0]), np.zeros(3), 0.1, 0.05)
    segments.follow(step, 0.0, estimate_at(START))
    for _ in range(unknown - 1):
        assert segments.follow(step, 0.0, None) is None
    assert segments.follow(step, 0.0, estimate_at(START)) is None


def test_nothing_is_compared_over_a_new_start_or_where_nothing_measures_the_motion() -> None:
    step = MotionStep(np.array([1.5, 0.0, 0.0]), np.zeros(3), 1.5, 0.5)
    unmeasured = MotionStep(np.array([1.5, 0.0, 0.0]), np.zeros(3), np.inf, 0.5)
    elsewhere = compose(START, inverse(np.array([9.0, 0.0, 0.0])))
    segments = OdometrySegments()
    segments.follow(step, 0.0, estimate_at(START))
    assert segments.follow(step, 0.0, estimate_at(START)) is not None
    segments.start_anew()
    assert segments.follow(step, 0.0, estimate_at(elsewhere)) is None
    assert segments.follow(unmeasured, 0.0, estimate_at(START)) is None
    assert segments.follow(step, 0.0, estimate_at(START)) is None
