"""A turn between two scans is found, and none is made up."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.sensors.motion.turn_search import with_turn_seen
from tests.sensors.worlds import CORRIDOR, ROOM, points_at

START = np.array([-1.0, 0.5, 0.3])


def found_motion(last: np.ndarray, points: np.ndarray, motion: Pose) -> Pose:
    return with_turn_seen(last, points, motion)


@settings(max_examples=20)
@given(st.floats(-0.48, 0.48), st.floats(-0.2, 0.2))
def test_a_turn_that_was_not_predicted_is_found(turn: float, forward: float) -> None:
    moved = np.array([forward, 0.0, turn])
    found = found_motion(points_at(ROOM, START), points_at(ROOM, compose(START, moved)), IDENTITY)
    assert abs(found[2] - turn) < 0.06
    np.testing.assert_array_equal(found[:2], IDENTITY[:2])


@settings(max_examples=20)
@given(st.floats(-0.3, 0.3), st.floats(-0.5, 0.5))
def test_a_motion_that_was_predicted_rightly_stays_as_it_is(turn: float, forward: float) -> None:
    motion = np.array([forward, 0.0, turn])
    found = found_motion(points_at(ROOM, START), points_at(ROOM, compose(START, motion)), motion)
    np.testing.assert_array_equal(found, motion)


@settings(max_examples=20)
@given(st.floats(0.0, 1.0))
def test_along_a_bare_corridor_the_prediction_stays(forward: float) -> None:
    start, motion = np.zeros(3), np.array([forward, 0.0, 0.0])
    found = found_motion(points_at(CORRIDOR, start), points_at(CORRIDOR, compose(start, motion)), motion)
    np.testing.assert_array_equal(found, motion)


def test_a_scan_that_saw_nothing_turns_nothing() -> None:
    motion = np.array([0.3, 0.0, 0.1])
    np.testing.assert_array_equal(found_motion(np.zeros((0, 2)), points_at(ROOM, START), motion), motion)
    np.testing.assert_array_equal(found_motion(points_at(ROOM, START), np.zeros((0, 2)), motion), motion)
