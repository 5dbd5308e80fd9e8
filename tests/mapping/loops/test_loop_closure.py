"""Second rounds are recognized, first ones are not, and look-alikes are left alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import box, store_of

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops.loop_closure import LoopCloser, nearest_pairs
from racecar.mapping.loops.submap import HALF_LENGTH, SPACING
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose

RING = np.concatenate(
    [box(-6, -4, 6, 4), box(-4, -2, 4, 2), box(-1, 2, 0, 2.5), box(2, -4, 2.4, -3.4), box(5.5, 1, 6, 3)]
)
"""12 x 8 m about a block, with things along the walls by which to tell where one is."""

STEP = 0.3


def way(corners: list[tuple[float, float]], rounds: float) -> Pose:
    """(K, 3) keyframes ``STEP`` apart along the sides of a polygon, round and round."""
    ends = np.array([*corners, corners[0]], dtype=float)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ends, axis=0).T))])
    at = np.arange(0.0, rounds * along[-1], STEP) % along[-1]
    places = np.stack([np.interp(at, along, axis) for axis in ends.T], axis=1)
    ahead = np.stack([np.interp((at + 0.5) % along[-1], along, axis) for axis in ends.T], axis=1)
    direction = ahead - places
    return np.column_stack([places, np.arctan2(direction[:, 1], direction[:, 0])])


def drifted(true: Pose, bias: tuple[float, float, float]) -> Pose:
    """The same way by dead reckoning that errs by ``bias`` (3,) in each step."""
    poses = [true[0]]
    for step in between(true[:-1], true[1:]):
        poses.append(compose(poses[-1], compose(step, bias)))
    return np.array(poses)


def closures(
    walls: np.ndarray, true: Pose, known: Pose, *, verify: bool = True, sight: float = 30.0
) -> list[Constraint]:
    closer = LoopCloser(store_of(walls, true, sight), verify=verify)
    found = []
    for k in range(len(true)):
        step = IDENTITY if k == 0 else between(known[k - 1], known[k])
        if closer.add_keyframe(float(np.hypot(step[0], step[1]))) is not None:
            found += closer.close(known[: k + 1])
    return found


def errors(found: list[Constraint], true: Pose) -> Pose:
    """(N, 3) of the closures, each in the frame of its second keyframe."""
    apart = [between(between(true[c.from_keyframe], true[c.to_keyframe]), c.from_pose_to_pose) for c in found]
    return np.array(apart).reshape(-1, 3)


AROUND = [(-5.0, -3.0), (5.0, -3.0), (5.0, 3.0), (-5.0, 3.0)]


@pytest.mark.parametrize("bias", [(0.0, 0.0, 0.0), (0.004, 0.0, 0.0), (0.0, 0.002, -0.0008)])
def test_a_second_round_closes_loops_that_are_true(bias: tuple[float, float, float]) -> None:
    true = way(AROUND, 1.8)
    found = closures(RING, true, drifted(true, bias))
    assert len(found) >= 3
    once_round = 32.0 / STEP
    for closure in found:
        assert closure.kind == "loop_closure"
        assert abs(closure.to_keyframe - closure.from_keyframe - once_round) < 6.0 / STEP
    is_told = np.array([np.diag(c.information) > 100.0 for c in found])  # 0.1 m, 6 degrees
    assert is_told.mean() > 0.9
    assert (np.abs(errors(found, true)) < [0.06, 0.06, 0.01])[is_told].all()


def test_a_first_round_has_nothing_to_close() -> None:
    true = way(AROUND, 0.8)
    assert closures(RING, true, true) == []


def test_look_alikes_far_from_where_the_car_may_be_are_left_alone() -> None:
    """Two rings of the same shape, 30 m apart: what is known of the way tells them apart."""
    first = way(AROUND, 0.95)
    aside = np.array([30.0, 0.0, 0.0])
    true = np.concatenate([first, compose(aside, first)])
    both = np.concatenate([RING, RING + aside[:2]])
    assert closures(both, true, true) == []


@pytest.mark.parametrize("bias", [(0.0, 0.0, 0.0), (0.012, 0.0, 0.0)])
def test_a_row_of_equal_niches_closes_no_wrong_loop(bias: tuple[float, float, float]) -> None:
    """Up and down a street; the niches are 2 m apart, and only its ends tell where one is."""
    niches = [box(x, side, x + 0.8, side * 1.3) for x in np.arange(-15.0, 15.0, 2.0) for side in (-2.0, 2.0)]
    street = np.concatenate([box(-18, -2.6, 18, 2.6), box(-14, -0.1, 14, 0.1), *niches])
    true = way([(0.0, -1.0), (15.0, -1.0), (15.0, 1.0), (-15.0, 1.0), (-15.0, -1.0)], 1.4)
    found = closures(street, true, drifted(true, bias), sight=6.0)
    assert found
    assert (np.abs(errors(found, true)) < [0.25, 0.25, 0.05]).all()


def test_one_submap_that_fits_is_believed_only_without_verification() -> None:
    """The round is over by one submap; the next one would be its witness."""
    true = way(AROUND, 1.07)
    assert closures(RING, true, true) == []
    assert len(closures(RING, true, true, verify=False)) == 1


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.02, 0.9), min_size=40, max_size=120))
def test_submaps_follow_each_other_at_even_distances(steps: list[float]) -> None:
    closer = LoopCloser(store_of(RING, np.zeros((0, 3))))
    path = np.cumsum(steps)
    for k, step in enumerate(steps):
        submap = closer.add_keyframe(step)
        if submap is not None:
            assert submap.last == k
    longest = max(steps)
    path -= path[0] - steps[0]
    for submap in closer.submaps:
        reach = path[submap.middle] - path[submap.first], path[submap.last] - path[submap.middle]
        assert max(reach) <= HALF_LENGTH + 2 * longest
        assert min(reach) >= HALF_LENGTH - 2 * longest
    middles = path[[submap.middle for submap in closer.submaps]]
    assert (np.abs(np.diff(middles) - SPACING) <= longest + 1e-9).all()
    assert len(middles) >= (path[-1] - 2 * HALF_LENGTH) / (SPACING + longest) - 2


def test_pairs_that_see_alike_come_first() -> None:
    first = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    second = np.array([[0.1, 0.0, np.pi], [0.5, 0.0, 0.1], [5.2, 0.0, 0.0]])
    a, b = nearest_pairs(first, second, 2)
    assert set(zip(a.tolist(), b.tolist(), strict=True)) == {(0, 1), (1, 2)}
