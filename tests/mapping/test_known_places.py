"""Only what earlier passes show, and loop closures tie to them, may be given up."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.known_places import pairs_with_known
from mapping.loop_closure import Hypothesis, LoopCloser
from mapping.scan_store import PreparedScan, ScanStore
from maps.se2 import IDENTITY, Pose, between

PER_LAP = 240


def laps(count: int, seed: int) -> Pose:
    """(PER_LAP * count, 3) round a circle of 12 m radius, 0.3 m apart, each lap up to a few decimetres beside
    the others."""
    angles = np.arange(PER_LAP * count) * (2.0 * np.pi / PER_LAP)
    radius = 12.0 + 0.3 * np.sin(0.7 * angles + seed)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), angles + np.pi / 2.0])


def driven(poses: Pose) -> LoopCloser:
    """Loop closure over keyframes of one point each, that has found nothing yet."""
    store = ScanStore(len(poses))
    for _ in poses:
        store.add(PreparedScan(*np.ones((2, 1, 2), dtype=np.float32)))
    loops = LoopCloser(store)
    for distance in np.hypot(*np.diff(poses[:, :2], axis=0, prepend=poses[:1, :2]).T):
        loops.add_keyframe(float(distance))
    return loops


def tie_laps(loops: LoopCloser, poses: Pose, every: int, per_lap: int = PER_LAP) -> None:
    """Close a loop from every so many submaps after the first lap to the nearest of that."""
    first_lap = [submap for submap in loops.submaps if submap.middle < per_lap]
    middles = poses[[submap.middle for submap in first_lap], :2]
    for moving in loops.submaps[len(first_lap) :: every]:
        nearest = int(np.argmin(np.hypot(*(middles - poses[moving.middle, :2]).T)))
        loops.accept([Hypothesis(first_lap[nearest], moving, IDENTITY, np.eye(3), 1.0)])


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 4), st.integers(0, 100))
def test_later_laps_are_known_by_the_first_one(count: int, seed: int) -> None:
    poses = laps(count, seed)
    loops = driven(poses)
    tie_laps(loops, poses, every=3)
    pairs = pairs_with_known(np.arange(len(poses)), poses, loops)
    known, given_up = pairs.T
    assert np.array_equal(given_up, np.arange(given_up[0], len(poses)))
    assert abs(given_up[0] - PER_LAP) < 10
    assert known.max() < given_up[0]
    apart = between(poses[known], poses[given_up])
    assert np.hypot(apart[:, 0], apart[:, 1]).max() < 1.0
    assert np.abs(apart[:, 2]).max() < 0.1


def test_a_lap_that_no_loop_ties_to_another_may_be_elsewhere() -> None:
    poses = laps(2, 0)
    assert len(pairs_with_known(np.arange(len(poses)), poses, driven(poses))) == 0


def test_who_comes_the_other_way_sees_something_else() -> None:
    there = laps(1, 0)[: PER_LAP // 2]
    poses = np.concatenate([there, there[::-1] + np.array([0.0, 0.0, np.pi])])
    loops = driven(poses)
    tie_laps(loops, poses, every=1, per_lap=len(there))
    assert len(pairs_with_known(np.arange(len(poses)), poses, loops)) == 0


def test_what_was_given_up_makes_nothing_known() -> None:
    poses = laps(3, 0)
    loops = driven(poses)
    tie_laps(loops, poses, every=3)
    loops.store.give_up(np.arange(PER_LAP))
    given_up = pairs_with_known(np.arange(len(poses)), poses, loops)[:, 1]
    assert abs(given_up[0] - 2 * PER_LAP) < 10
