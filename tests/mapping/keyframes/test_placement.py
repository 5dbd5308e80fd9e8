"""A keyframe finds its place whichever guess is right: how likely each is, and what its scan says of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.keyframes.gap import Gap, gap_after
from racecar.mapping.keyframes.motion_prior import guess_shares, log_likelihood
from racecar.mapping.keyframes.placement import KeyframePlacer
from racecar.mapping.keyframes.scan_evidence import scan_evidence
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.matching.scan_matching import Pairings, match
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


@settings(max_examples=10)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.1, 0.1))
def test_a_room_like_the_last_one_behind_a_gap_is_not_taken_for_it(
    forward: float, aside: float, turn: float
) -> None:
    twins = np.concatenate([ROOM, ROOM + np.array([20.0, 0.0])])
    true = path(np.array([0.1, 0.0, 0.0]), (-2.15, -0.5, 0.1), BEFORE)
    true[-1] = compose(true[-2] + [20.0, 0.0, 0.0], [0.3, 0.2, 0.1])
    by_wheels = compose(between(true[-2], true[-1]), [forward, aside, turn])
    prior = WheelCalibration().prior(by_wheels)
    placer = KeyframePlacer(BEFORE, store_of(twins, true), true[:-1], true[-2], prior)
    placed = placer.place(compose(true[-2], by_wheels)[None], Gap.DRIVEN)
    error = between(compose(true[-2], by_wheels), placed.pose)
    assert np.hypot(error[0], error[1]) < 0.05
    assert abs(error[2]) < 0.02


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


FAR, NEAR = np.array([0.9, 0.3, 0.2]), np.array([0.3, 0.0, 2.0])


@pytest.mark.parametrize(
    ("seconds", "step", "gap"),
    [
        (0.5, FAR, Gap.NONE),
        (0.6, FAR, Gap.DRIVEN),
        (0.6, NEAR, Gap.NONE),
        (0.6, None, Gap.NONE),
        (2.1, FAR, Gap.DRIVEN),
        (2.1, NEAR, Gap.LEFT_ALONE),
        (2.1, None, Gap.LEFT_ALONE),
    ],
)
def test_a_car_that_stood_must_be_out_of_sight_for_longer(
    seconds: float, step: np.ndarray | None, gap: Gap
) -> None:
    assert gap_after(round(seconds * 1e9), step, 0.3) == gap


def evidence(walls: np.ndarray, poses: Pose, places: Pose) -> np.ndarray:
    """Of places (G, 3) where the last of some scans may have been taken, beside the others."""
    store, fixed = store_of(walls, poses), np.arange(len(poses) - 1)
    groups = len(places)
    pairs = np.tile(np.column_stack([fixed, np.full(len(fixed), len(fixed))]), (groups, 1))
    pairings = Pairings(
        np.arange(groups + 1) * len(fixed),
        pairs,
        np.tile(poses[:-1], (groups, 1)),
        np.zeros((groups * len(fixed), 3)),
    )
    stay = 1e12 * np.eye(3)
    matches = match(places, pairings, store, store, prior_information=stay)
    return scan_evidence(store, fixed, poses[:-1], len(fixed), matches)


@settings(max_examples=20)
@given(st.floats(0.3, 0.8), st.floats(-np.pi, np.pi), st.sampled_from([-0.6, 0.0, 0.6]))
def test_the_true_place_has_the_most(missed: float, towards: float, turned: float) -> None:
    poses = path(np.array((0.2, 0.0, 0.05)), (-2.0, -0.5, 0.1), 5)
    off = np.array([missed * np.cos(towards), missed * np.sin(towards), turned])
    true, wrong = evidence(ROOM, poses, np.stack([poses[-1], compose(poses[-1], off)]))
    assert true > 40.0
    assert wrong < true - 10.0


@pytest.mark.parametrize("ahead", [-0.4, 0.4])
def test_along_a_bare_corridor_all_places_have_as_much(ahead: float) -> None:
    poses = path(np.array((0.4, 0.0, 0.0)), (0.0, 0.0, 0.0), 5)
    true, shifted = evidence(CORRIDOR, poses, np.stack([poses[-1], poses[-1] + [ahead, 0.0, 0.0]]))
    assert abs(true - shifted) < 3.0


def test_scans_that_see_nothing_say_nothing() -> None:
    out_of_reach = box(-99.0, -99.0, 99.0, 99.0)
    poses = path(np.array((0.2, 0.0, 0.0)), (0.0, 0.0, 0.0), 5)
    np.testing.assert_array_equal(evidence(out_of_reach, poses, poses[-2:]), 0.0)


SIGMA = 0.05
GUESSES = np.array([[1.0, 0.0, 0.2], [-1.0, 0.5, 0.0]])
SHARES = np.array([0.9, 0.09])
REACH, VOLUME = 1.5, 18.0 * np.pi
"""Metres to each side, and that over all headings."""

offs = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def likelihood(poses: list[Pose], guesses: Pose = GUESSES, shares: np.ndarray = SHARES) -> np.ndarray:
    return log_likelihood(np.array(poses), guesses, shares, np.eye(3) / SIGMA**2, REACH)


def test_the_first_guess_is_trusted_unless_it_is_doubted() -> None:
    trusted = guess_shares(3, is_first_doubted=False, is_left_alone=False)
    assert trusted[0] > 0.95
    assert trusted[1] == trusted[2] < 0.01
    doubted = guess_shares(3, is_first_doubted=True, is_left_alone=False)
    assert doubted[0] == doubted[1] == doubted[2]


def test_where_the_car_may_have_been_carried_all_guesses_may_be_wrong() -> None:
    driven, carried = (
        guess_shares(2, is_first_doubted=False, is_left_alone=is_left_alone).sum()
        for is_left_alone in (False, True)
    )
    assert carried < 0.8 < 0.99 < driven < 1.0


def test_where_the_first_guess_leads_is_as_likely_as_it_is_trusted() -> None:
    first, other = likelihood(list(GUESSES))
    assert np.isclose(first, 0.0, atol=1e-3)
    assert np.isclose(other, np.log(0.1), atol=0.05)


@given(offs, st.floats(0.0, 1.0))
def test_nearer_to_the_guesses_is_likelier(off: np.ndarray, share: float) -> None:
    poses = compose(GUESSES[0], np.array([share * off, off]))
    near, far = likelihood(list(poses), GUESSES[:1], np.array([0.99]))
    assert near >= far - 1e-9


@given(offs)
def test_no_place_is_impossible(off: np.ndarray) -> None:
    (anywhere,) = likelihood([100.0 * off + [500.0, 0.0, 0.0]])
    uniform = 0.01 / VOLUME
    peak = 0.9 * 2.0 / (np.sqrt(np.pi) / 2.0 * (3.0 * np.pi) ** 1.5) / SIGMA**3
    assert np.isclose(anywhere, np.log(uniform / peak), atol=0.01)


def test_a_guess_that_misses_by_ten_standard_deviations_is_likelier_than_chance() -> None:
    """Wheels that slip err so; a Gaussian would call it impossible."""
    missed, anywhere = likelihood(
        [compose(GUESSES[0], [10 * SIGMA, 0.0, 0.0]), compose(GUESSES[0], [50.0, 0.0, 0.0])]
    )
    assert missed > anywhere + 3.0
