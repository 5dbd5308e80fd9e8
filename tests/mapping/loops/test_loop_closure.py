"""Second rounds are recognized, first ones are not, and look-alikes are left alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops import loop_closure, submap_graph
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from tests.mapping.sessions import RING, path
from tests.sensors.worlds import box, store_of

STEP = 0.3
STEP_VARIANCES = np.array([[0.012**2, 0.0015**2]])
"""Square metres and radians: some 0.2 m and 1 degree on the way round the ring."""
ONCE_ROUND = 32.0
"""Metres."""


def drifted(true: Pose, bias: tuple[float, float, float]) -> Pose:
    """The same path by dead reckoning that errs by ``bias`` (3,) in each step."""
    poses = [true[0]]
    for step in between(true[:-1], true[1:]):
        poses.append(compose(poses[-1], compose(step, bias)))
    return np.array(poses)


def closures(
    walls: np.ndarray, true: Pose, known: Pose, *, sight: float = 30.0, **settings: float
) -> list[Constraint]:
    closer = LoopCloser(store_of(walls, true, sight), **settings)
    found = []
    for k in range(len(true)):
        step = IDENTITY if k == 0 else between(known[k - 1], known[k])
        closer.history.graph.add_variances(STEP_VARIANCES)
        if closer.history.graph.add_keyframe(float(np.hypot(step[0], step[1]))) is not None:
            found += closer.close(known[: k + 1])
    return found


def errors(found: list[Constraint], true: Pose) -> Pose:
    """(N, 3) of the closures, each in the frame of its second keyframe."""
    apart = [between(between(true[c.from_keyframe], true[c.to_keyframe]), c.from_pose_to_pose) for c in found]
    return np.array(apart).reshape(-1, 3)


@pytest.mark.parametrize("bias", [(0.0, 0.0, 0.0), (0.004, 0.0, 0.0), (0.0, 0.002, -0.0008)])
def test_a_second_round_closes_loops_that_are_true(bias: tuple[float, float, float]) -> None:
    true = path(0.0, 1.8 * ONCE_ROUND)
    found = closures(RING, true, drifted(true, bias))
    assert len(found) >= 3
    for closure in found:
        assert closure.kind == "loop_closure"
        assert abs(closure.to_keyframe - closure.from_keyframe - ONCE_ROUND / STEP) < 6.0 / STEP
    is_observed = np.array([np.diag(c.information) > 100.0 for c in found])  # 0.1 m, 6 degrees
    assert is_observed.mean() > 0.9
    assert (np.abs(errors(found, true)) < [0.06, 0.06, 0.015])[is_observed].all()  # drift bends submaps


def test_a_first_round_has_nothing_to_close() -> None:
    true = path(0.0, 0.8 * ONCE_ROUND)
    assert closures(RING, true, true) == []


def test_look_alikes_far_from_where_the_car_may_be_are_left_alone() -> None:
    """Two rings of the same shape, 30 m apart: the distance driven tells them apart."""
    first = path(0.0, 0.95 * ONCE_ROUND)
    aside = np.array([30.0, 0.0, 0.0])
    true = np.concatenate([first, compose(aside, first)])
    both = np.concatenate([RING, RING + aside[:2]])
    assert closures(both, true, true) == []


@pytest.mark.parametrize("bias", [(0.0, 0.0, 0.0), (0.012, 0.0, 0.0)])
def test_a_row_of_equal_niches_closes_no_wrong_loop(bias: tuple[float, float, float]) -> None:
    """Up and down a street; the niches are 2 m apart, and only its ends make places unique."""
    niches = [box(x, side, x + 0.8, side * 1.3) for x in np.arange(-15.0, 15.0, 2.0) for side in (-2.0, 2.0)]
    street = np.concatenate([box(-18, -2.6, 18, 2.6), box(-14, -0.1, 14, 0.1), *niches])
    corners = np.array([(0.0, -1.0), (15.0, -1.0), (15.0, 1.0), (-15.0, 1.0), (-15.0, -1.0)])
    true = path(0.0, 1.4 * 64.0, corners)
    found = closures(street, true, drifted(true, bias), sight=6.0)
    assert found
    assert (np.abs(errors(found, true)) < [0.25, 0.25, 0.05]).all()


def test_one_submap_that_fits_is_not_believed_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The round is over by one submap; the next one would support it."""
    true = path(0.0, 1.07 * ONCE_ROUND)
    assert closures(RING, true, true) == []
    monkeypatch.setattr(loop_closure, "is_supported", lambda *_: True)
    assert len(closures(RING, true, true)) == 1


def test_scans_that_are_looked_through_refute_a_loop() -> None:
    """Nothing satisfies an agreement above one, so no hypothesis is left."""
    true = path(0.0, 1.8 * ONCE_ROUND)
    assert closures(RING, true, true) != []
    assert closures(RING, true, true, least_agreement=1.01) == []


def test_what_lies_beyond_a_turn_may_be_farther_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of submaps 2 m apart that err 0.1 m and 0.01 rad each; the last sees the first across 20 m."""
    monkeypatch.setattr(submap_graph, "HALF_LENGTH", 2.0)
    graph = SubmapGraph()
    for step in np.full(30, 1.0):
        graph.add_keyframe(float(step))
        graph.add_variances(np.array([[0.005, 0.5e-4]]))
    count = len(graph.submaps)
    along = np.column_stack([2.0 * np.arange(count), np.zeros(count)])
    straight, turn = graph.spreads_from(count - 1, along)
    back, _ = graph.spreads_from(count - 1, np.column_stack([np.abs(along[:, 0] - 10.0), along[:, 1]]))
    np.testing.assert_allclose(turn, 0.01 * np.sqrt(np.arange(count)[::-1]))
    assert straight[0] > back[0] > 0.1 * np.sqrt(count - 1)
    graph.close(graph.submaps[0], graph.submaps[-1])
    assert graph.spreads_from(count - 1, along)[0][0] < 0.3 * back[0]


@settings(max_examples=25)
@given(st.lists(st.floats(0.02, 0.9), min_size=40, max_size=120), st.floats(1.0, 4.0), st.floats(1.0, 5.0))
def test_submaps_follow_each_other_at_even_distances(
    steps: list[float], spacing: float, half_length: float
) -> None:
    graph, along = SubmapGraph(), np.cumsum(steps)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(submap_graph, "SPACING", spacing)
        patched.setattr(submap_graph, "HALF_LENGTH", half_length)
        completed = [graph.add_keyframe(step) for step in steps]
    assert all(submap.last == k for k, submap in enumerate(completed) if submap is not None)
    longest = max(steps)
    along -= along[0] - steps[0]
    for submap in graph.submaps:
        reach = along[submap.middle] - along[submap.first], along[submap.last] - along[submap.middle]
        assert max(reach) <= half_length + 2 * longest
        assert reach[0] >= min(half_length - 2 * longest, along[submap.middle] - along[0])
        assert reach[1] >= half_length - 2 * longest
    middles = along[[submap.middle for submap in graph.submaps]]
    gaps = np.full(max(len(middles) - 1, 0), spacing)
    gaps[:1] = max(spacing, half_length)  # after that of the start
    assert (np.abs(np.diff(middles) - gaps) <= longest + 1e-9).all()
    assert len(middles) >= (along[-1] - 2 * half_length) / (spacing + longest) - 2


def test_pairs_that_see_alike_come_first() -> None:
    first = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    second = np.array([[0.1, 0.0, np.pi], [0.5, 0.0, 0.1], [5.2, 0.0, 0.0]])
    a, b = nearest_pairs(first, second, 2)
    assert set(zip(a.tolist(), b.tolist(), strict=True)) == {(0, 1), (1, 2)}
