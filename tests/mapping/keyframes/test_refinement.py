"""Scans between keyframes: first where dead reckoning has them, then where they fit."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from racecar.mapping.keyframes.final_optimization import mean_bend
from racecar.mapping.keyframes.refinement import guess_scans, refine_scans
from racecar.maps.geometry.se2 import Pose, between, compose
from tests.sensors.worlds import CORRIDOR, ROOM, path, points_at, store_of

PER_KEYFRAME = 4
KEYFRAMES = 9
SCANS = (KEYFRAMES - 1) * PER_KEYFRAME + 3
KEYFRAME_SCANS = PER_KEYFRAME * np.arange(KEYFRAMES)
STAMPS = 25_000_000 * np.arange(SCANS)
AFTER_KEYFRAME = np.arange(SCANS) // PER_KEYFRAME
steps = st.tuples(st.floats(0.0, 0.12), st.floats(-0.02, 0.02), st.floats(-0.08, 0.08)).map(np.array)


def driven(step: Pose) -> Pose:
    return path(step, (-2.0, -1.0, 0.1), SCANS - 1)


def guessed(true: Pose, measured: Pose, stamps: np.ndarray = STAMPS) -> Pose:
    """From a path (N, 3) as dead reckoning ``measured`` it and keyframes where they are in truth."""
    return guess_scans(
        stamps,
        np.arange(SCANS),
        between(measured[KEYFRAME_SCANS][AFTER_KEYFRAME], measured),
        KEYFRAME_SCANS,
        between(measured[KEYFRAME_SCANS[:-1]], measured[KEYFRAME_SCANS[1:]]),
        true[KEYFRAME_SCANS],
    )


def assert_same(poses: Pose, others: Pose, distance: float, angle: float) -> None:
    apart = between(poses, others)
    assert np.hypot(apart[:, 0], apart[:, 1]).max() <= distance
    assert np.abs(apart[:, 2]).max() <= angle


@given(steps)
def test_exact_dead_reckoning_is_left_as_it_is(step: Pose) -> None:
    assert_same(guessed(driven(step), driven(step)), driven(step), 1e-9, 1e-9)


@given(steps, st.floats(-0.02, 0.02), st.floats(-0.01, 0.01))
def test_what_dead_reckoning_missed_is_spread_between_keyframes(step: Pose, slip: float, turn: float) -> None:
    true, measured = driven(step), driven(compose(step, [slip, 0.0, turn]))
    guesses = guessed(true, measured)
    assert_same(guesses[KEYFRAME_SCANS], true[KEYFRAME_SCANS], 1e-9, 1e-9)
    # Every scan in between misses by less than dead reckoning did in a whole step from keyframe to keyframe.
    held = slice(0, KEYFRAME_SCANS[-1])
    missed = np.hypot(
        *between(true[PER_KEYFRAME], compose(true[0], between(measured[0], measured[PER_KEYFRAME])))[:2]
    )
    assert_same(guesses[held], true[held], 0.5 * missed + 1e-3, abs(turn) + 1e-9)


def test_what_was_missed_over_a_pause_does_not_move_the_scans_before_it() -> None:
    """The car was carried on meanwhile."""
    measured = driven(np.array([0.01, 0.0, 0.0]))
    first_after = KEYFRAME_SCANS[3]
    true = measured.copy()
    true[first_after:] = compose([1.0, 0.5, 0.0], measured[first_after:])
    stamps = STAMPS.copy()
    stamps[first_after:] += 80_000_000_000
    assert_same(guessed(true, measured, stamps), true, 0.01, 1e-9)


def test_a_car_that_stood_before_a_pause_stays_where_it_stood() -> None:
    """It stood for longer than the pause took, in which it was carried on."""
    stamps = 100_000_000 * np.arange(101)
    stamps[100:] += 3_000_000_000
    still, keyframe_scans = np.zeros((101, 3)), np.array([0, 100])
    found = guess_scans(
        stamps, np.arange(101), still, keyframe_scans, still[:1], np.array([still[0], [1.0, 0.6, 0.0]])
    )
    assert_same(found[:100], still[:100], 0.12, 1e-9)


@settings(max_examples=8)
@given(steps, st.integers(0, 10_000))
def test_scans_find_their_place(step: Pose, seed: int) -> None:
    true = driven(step)
    assume(np.all(true[:, 1] > -1.9))  # no car drives through the pillar, or out through the wall behind it
    off = np.random.default_rng(seed).uniform(-1.0, 1.0, (SCANS, 3)) * [0.06, 0.06, 0.03]
    clouds = [points_at(ROOM, pose).astype(np.float32) for pose in true]
    keyframes = true[KEYFRAME_SCANS]
    refined = refine_scans(clouds, AFTER_KEYFRAME, compose(true, off), store_of(ROOM, keyframes), keyframes)
    assert_same(refined, true, 0.02, 0.01)


@pytest.mark.parametrize("turn", [0.35, -0.35])
def test_a_turn_that_nothing_measured_is_found(turn: float) -> None:
    """Held fast between two keyframes, the car is turned aside bit by bit and back at once."""
    still = np.tile([-2.0, -1.0, 0.1], (40, 1))
    aside = np.interp(np.arange(40), [8, 14, 24, 25], [0.0, turn, turn, 0.0])
    true = still + aside[:, None] * [0.0, 0.0, 1.0]
    keyframes = np.array([still[0], compose(still[0], [0.3, 0.0, 0.0])])
    clouds = [points_at(ROOM, pose).astype(np.float32) for pose in true]
    after = np.zeros(40, dtype=np.int64)
    assert_same(refine_scans(clouds, after, still, store_of(ROOM, keyframes), keyframes), true, 0.02, 0.01)


def test_along_a_bare_corridor_the_guess_holds() -> None:
    true = driven(np.array([0.1, 0.0, 0.0])) * [1.0, 0.0, 0.0]
    off = np.array([0.1, 0.05, 0.02])
    clouds = [points_at(CORRIDOR, pose).astype(np.float32) for pose in true]
    keyframes = true[KEYFRAME_SCANS]
    refined = refine_scans(clouds, AFTER_KEYFRAME, true + off, store_of(CORRIDOR, keyframes), keyframes)
    np.testing.assert_allclose(refined[:, 0] - true[:, 0], 0.1, atol=0.01)
    np.testing.assert_allclose(refined[:, 1:] - true[:, 1:], 0.0, atol=0.01)


def test_scans_of_another_pass_count_too() -> None:
    """Keyframes near in time see nothing; those of a pass long before pull the scan into place."""
    place, elsewhere = np.array([-1.0, 0.0, 0.2]), np.array([1e3, 1e3, 0.0])
    first_pass = np.array([compose(place, [0.1 * k, 0.0, 0.0]) for k in range(-2, 3)])
    between_passes = np.tile(elsewhere, (10, 1))
    keyframes = np.concatenate([first_pass, between_passes])
    off = compose(place, [0.06, -0.05, 0.02])
    cloud = points_at(ROOM, place).astype(np.float32)
    after = np.array([len(keyframes) - 1])
    refined = refine_scans([cloud], after, off[None], store_of(ROOM, keyframes), keyframes)
    assert_same(refined, place[None], 0.02, 0.01)


LINE = np.column_stack([np.arange(50) * 0.3, np.zeros((50, 2))])
poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.0, 3.0)).map(np.array)


@given(poses)
def test_a_path_that_moves_as_a_whole_is_not_bent(map_from_line: Pose) -> None:
    assert mean_bend(LINE, compose(map_from_line, LINE), 30) < 1e-9


@given(st.floats(-0.2, 0.2))
def test_a_path_that_grows_is_bent_by_as_much_over_so_many_keyframes(share: float) -> None:
    assert mean_bend(LINE, LINE * [1.0 + share, 1.0, 1.0], 30) == pytest.approx(abs(share) * 9.0)


def test_a_path_of_few_keyframes_is_bent_as_its_ends_are() -> None:
    assert mean_bend(LINE[:3], LINE[:3] * [1.5, 1.0, 1.0], 30) == pytest.approx(0.3)
