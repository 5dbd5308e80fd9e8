"""A keyframe finds its place whichever of the guesses is right, and when none is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.keyframes.gap import Gap
from racecar.mapping.keyframes.placement import KeyframePlacer
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.motion.calibration import WheelCalibration
from tests.sensors.worlds import CORRIDOR, ROOM, box, path, store_of

PRIOR = WheelCalibration().prior(IDENTITY)
BEFORE = 12
AHEAD = np.array([0.1, 0.0, 0.0])


def placed_from(
    walls: np.ndarray, true: Pose, steps: list[Pose], *, repeats: bool = False
) -> tuple[Pose, int]:
    """The last pose (3,) as placed from guesses of its step, seen from the true one; and which guess won."""
    guesses, store = compose(true[-2], np.array(steps)), store_of(walls, true)
    placer = KeyframePlacer(BEFORE, store, true[:-1], true[-2], PRIOR, is_first_doubted=repeats)
    placed = placer.place(guesses)
    return between(true[-1], placed.pose), placed.guess


@settings(max_examples=20)
@given(st.floats(0.1, 0.3), st.floats(-0.12, 0.12))
def test_wheels_that_count_backwards_are_overruled(forward: float, turn: float) -> None:
    step = np.array([forward, 0.0, turn])
    true = path(step, (-2.15, -0.5, 0.1), BEFORE)
    error, _ = placed_from(ROOM, true, [-step, compose(step, [0.02, -0.02, 0.01]), step])
    assert np.hypot(error[0], error[1]) < 0.02
    assert abs(error[2]) < 0.01


@settings(max_examples=20)
@given(st.floats(0.1, 0.5), st.floats(-0.4, 0.4), st.floats(-0.05, 0.05))
def test_along_a_bare_corridor_the_wheels_win_over_a_stuck_guess(
    forward: float, aside: float, turn: float
) -> None:
    step = np.array([forward, 0.0, 0.0])
    true = path(step, (0.0, aside, 0.0), BEFORE)
    error, chosen = placed_from(CORRIDOR, true, [np.array([forward, 0.0, turn]), IDENTITY, IDENTITY])
    assert chosen == 0
    assert abs(error[0]) < 0.02
    assert abs(error[1]) < 0.02
    assert abs(error[2]) < 0.01


@settings(max_examples=10)
@given(st.floats(2.0, 40.0), st.floats(-1.0, 1.0), st.floats(-0.1, 0.1))
def test_a_bare_corridor_goes_on_behind_a_gap_as_far_as_the_wheels_say(
    forward: float, aside: float, turn: float
) -> None:
    """Where it was before, all of what it sees lies on what it saw; where it is, little or nothing does."""
    true = path(np.array([0.4, 0.0, 0.0]), (-60.0, 0.0, 0.0), BEFORE)
    true[-1] = true[-2] + [forward, 0.0, 0.0]
    by_wheels = np.array([forward, aside, turn])
    prior = WheelCalibration().prior(by_wheels)
    store = store_of(CORRIDOR, true, sight=12.0)
    placer = KeyframePlacer(BEFORE, store, true[:-1], true[-2], prior)
    placed = placer.place(compose(true[-2], by_wheels)[None], Gap.DRIVEN)
    error = between(true[-1], placed.pose)
    assert abs(error[0]) < 0.2
    assert abs(error[1]) < 0.05
    assert abs(error[2]) < 0.01


NICHES = np.concatenate([CORRIDOR, *(box(x, 0.9, x + 0.3, 1.1) for x in (-3.1, -1.0, 2.2, 4.3))])
"""The corridor with a few pillars that stand out a little."""


def test_wheels_that_repeat_a_pose_yield_to_the_little_that_a_corridor_shows() -> None:
    step = np.array([0.4, 0.0, 0.0])
    true = path(step, (-2.4, 0.0, 0.0), BEFORE)
    error, chosen = placed_from(NICHES, true, [IDENTITY, step, step], repeats=True)
    assert chosen == 1
    assert np.hypot(error[0], error[1]) < 0.02


@settings(max_examples=10)
@given(st.floats(0.1, 0.5))
def test_a_car_that_stands_is_not_moved_by_a_guess(forward: float) -> None:
    driven = path(np.array([0.4, 0.0, 0.0]), (-2.4, 0.0, 0.0), BEFORE)[1:]
    true = np.concatenate([driven, driven[-1:]])
    ahead = np.array([forward, 0.0, 0.0])
    error, chosen = placed_from(NICHES, true, [IDENTITY, ahead, ahead], repeats=True)
    assert chosen == 0
    assert np.hypot(error[0], error[1]) < 0.02


@settings(max_examples=10)
@given(st.floats(0.8, 1.3), st.floats(-np.pi, np.pi), st.sampled_from([-1.0, 1.0]), st.floats(0.4, 0.7))
def test_a_lost_scan_is_found_again_by_the_search(
    missed: float, towards: float, side: float, turned: float
) -> None:
    """From guesses that are turned less a scan may fit by chance: one in two hundred at 0.35 rad."""
    step = np.array([0.2, 0.0, 0.05])
    true = path(step, (-2.0, -0.5, 0.1), BEFORE)
    wrong = compose(step, [missed * np.cos(towards), missed * np.sin(towards), side * turned])
    error, _ = placed_from(ROOM, true, [wrong, wrong, wrong])
    assert np.hypot(error[0], error[1]) < 0.03
    assert abs(error[2]) < 0.01


@pytest.mark.parametrize("start", [(-2.0, -0.5, 0.1), (2.0, -1.0, 2.0), (0.0, 1.0, -1.0)])
@pytest.mark.parametrize("missed", [-0.6, -0.36, 0.36, 0.6])
@pytest.mark.parametrize("turn", [-0.05, 0.05, 0.1])
def test_a_turn_that_no_guess_knows_of_is_found_though_the_scans_overlap(
    turn: float, missed: float, start: tuple[float, float, float]
) -> None:
    step = np.array([0.2, 0.0, turn])
    wrong = compose(step, [0.0, 0.0, missed])
    error, _ = placed_from(ROOM, path(step, start, BEFORE), [wrong, wrong, wrong])
    assert np.hypot(error[0], error[1]) < 0.03
    assert abs(error[2]) < 0.01


def test_without_points_the_first_guess_stands() -> None:
    step = np.array([0.2, 0.0, 0.05])
    out_of_reach = box(-99.0, -99.0, 99.0, 99.0)
    true = path(step, (0.0, 0.0, 0.0), BEFORE)
    error, chosen = placed_from(out_of_reach, true, [compose(step, AHEAD), step, step])
    assert chosen == 0
    np.testing.assert_allclose(error, AHEAD, atol=1e-6)
