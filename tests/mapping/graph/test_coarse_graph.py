"""Groups of keyframes stand for all of them: their constraints are those of the keyframes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.graph.coarse_graph import Groups, between_groups
from racecar.mapping.graph.constraint import Constraint, ConstraintList, Kind
from racecar.maps.geometry.se2 import Pose, between, compose, inverse

COUNT = 24
MIDDLES = np.array([3, 9, 15, 20])
STEADY_DRIFT = 0.3 * np.arange(COUNT)
LOSS_WIDTH = 1.0


def drive(seed: int) -> Pose:
    """(K, 3) poses along a bent path."""
    rng = np.random.default_rng(seed)
    poses = [np.zeros(3)]
    for step in np.column_stack([np.full(COUNT - 1, 0.3), rng.normal(0, [[0.02], [0.2]], (2, COUNT - 1)).T]):
        poses.append(compose(poses[-1], step))
    return np.array(poses)


def groups(accumulated_drift: np.ndarray = STEADY_DRIFT) -> Groups:
    return Groups(MIDDLES, accumulated_drift)


def ties(poses: Pose, rng: np.random.Generator, kind: Kind = "scan_matching") -> list[Constraint]:
    """From each keyframe to those before, of random information."""
    roots = rng.normal(0, 10, (COUNT, 8, 3, 3))
    return [
        Constraint(k - back, k, between(poses[k - back], poses[k]), roots[k, back] @ roots[k, back].T, kind)
        for k in range(COUNT)
        for back in (1, 2, 4, 7)
        if back <= k
    ]


seeds = st.integers(0, 10_000)


@given(seeds)
def test_keyframes_that_fit_leave_their_groups_where_they_are(seed: int) -> None:
    true = drive(seed)
    for constraint in between_groups(
        ConstraintList(ties(true, np.random.default_rng(seed))), true, groups(), LOSS_WIDTH
    ):
        a, b = MIDDLES[[constraint.from_keyframe, constraint.to_keyframe]]
        np.testing.assert_allclose(constraint.from_pose_to_pose, between(true[a], true[b]), atol=1e-9)


@given(seeds, st.sampled_from(["scan_matching", "odometry"]))
def test_a_group_that_was_moved_is_drawn_back_to_where_it_belongs(seed: int, kind: Kind) -> None:
    rng = np.random.default_rng(seed)
    true = drive(seed)
    nearest = groups().nearest()
    slips = rng.normal(0, 1e-4, (len(MIDDLES), 3))
    middles = compose(true[MIDDLES], slips)
    poses = compose(middles[nearest], between(true[MIDDLES][nearest], true))
    for constraint in between_groups(ConstraintList(ties(true, rng, kind)), poses, groups(), LOSS_WIDTH):
        a, b = MIDDLES[[constraint.from_keyframe, constraint.to_keyframe]]
        np.testing.assert_allclose(constraint.from_pose_to_pose, between(true[a], true[b]), atol=1e-6)


def test_information_of_a_pair_is_that_of_all_its_constraints() -> None:
    true = drive(0)
    matches = [
        Constraint(3, 9, between(true[3], true[9]), np.diag([1.0, 2.0, 3.0]), "scan_matching"),
        Constraint(2, 9, between(true[2], true[9]), np.diag([4.0, 5.0, 6.0]), "scan_matching"),
    ]
    (both,) = between_groups(ConstraintList(matches), true, groups(), LOSS_WIDTH)
    assert (both.from_keyframe, both.to_keyframe) == (0, 1)
    np.testing.assert_allclose(both.information, np.diag([5.0, 7.0, 9.0]), atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "loss_width", "share"),
    [("scan_matching", 1.0, 0.5), ("scan_matching", 2.0, 0.8), ("odometry", 1.0, 1.0)],
)
def test_a_match_that_misses_counts_less(kind: Kind, loss_width: float, share: float) -> None:
    true = drive(0)
    measured = compose(between(true[3], true[9]), [1.0, 0.0, 0.0])
    constraints = ConstraintList([Constraint(3, 9, measured, np.eye(3), kind)])
    (only,) = between_groups(constraints, true, groups(), loss_width)
    np.testing.assert_allclose(only.information, share * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(only.from_pose_to_pose, measured, atol=1e-12)


def test_loop_closures_stay_one_by_one() -> None:
    true = drive(0)
    loops = [Constraint(3, 20, np.array([x, 0.0, 0.0]), np.eye(3), "loop_closure") for x in (1.0, 2.0)]
    coarse = between_groups(ConstraintList(loops), true, groups(), LOSS_WIDTH)
    assert [(c.from_keyframe, c.to_keyframe, c.kind) for c in coarse] == [(0, 3, "loop_closure")] * 2
    assert [c.from_pose_to_pose[0] for c in coarse] == [1.0, 2.0]


@given(seeds)
def test_all_are_carried_with_the_middles(seed: int) -> None:
    true = drive(seed)
    np.testing.assert_allclose(groups().carry(true, true[MIDDLES]), true, atol=1e-9)
    moved_to = compose(true[MIDDLES], np.random.default_rng(seed).normal(0, 0.5, (len(MIDDLES), 3)))
    carried = groups().carry(true, moved_to)
    np.testing.assert_allclose(carried[MIDDLES], moved_to, atol=1e-9)
    for middle, ends in ((0, slice(0, MIDDLES[0])), (-1, slice(MIDDLES[-1], COUNT))):
        inside = compose(inverse(true[MIDDLES[middle]]), true[ends])
        np.testing.assert_allclose(carried[ends], compose(moved_to[middle], inside), atol=1e-9)


def test_a_gap_takes_what_lies_between_two_groups() -> None:
    true = drive(0)
    moved_to = true[MIDDLES].copy()
    moved_to[2:, 0] += 5.0
    drift = STEADY_DRIFT.copy()
    drift[12:] += 60.0
    moved = groups(drift).carry(true, moved_to) - true
    assert np.abs(moved[:12]).max() < 0.1
    assert np.abs(moved[12:, 0] - 5.0).max() < 0.1
