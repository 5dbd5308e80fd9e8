"""How a pose graph moves where constraints err as they state, or wheels slip, against what is known in
closed form."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.graph_motion import GraphMotion
from racecar.mapping.quality.slip import slip_errors, slip_share
from racecar.maps.geometry.se2 import Pose, between
from tests.mapping.sessions import chain

SIGMA = np.array([0.01, 0.02, 0.003])
STRAIGHT = np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)])


def tie(first: int, second: int, poses: np.ndarray, sigma: np.ndarray = SIGMA) -> Constraint:
    return Constraint(
        first, second, between(poses[first], poses[second]), np.diag(sigma**-2.0), "scan_matching"
    )


CHAIN = [tie(k, k + 1, STRAIGHT) for k in range(10)]


def spread(constraints: list[Constraint], poses: np.ndarray, pair: tuple[int, int]) -> float:
    edges = GraphEdges.of(ConstraintList(constraints), poses)
    return float(GraphMotion(edges, poses).spreads(np.array([pair]))[0])


def test_a_straight_chain_spreads_as_its_steps_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("racecar.mapping.quality.graph_motion._DRAWS", 5000)
    levers = np.arange(7)  # metres from the end of each of seven steps to the last keyframe
    expected = 7 * (SIGMA[0] ** 2 + SIGMA[1] ** 2) + SIGMA[2] ** 2 * np.sum(levers**2)
    assert spread(CHAIN, STRAIGHT, (2, 9)) == pytest.approx(np.sqrt(expected), rel=0.03)


def test_it_does_not_matter_where_the_map_lies_and_how_it_is_turned() -> None:
    turned = np.column_stack(
        [5.0 + 0.6 * STRAIGHT[:, 0], 9.0 + 0.8 * STRAIGHT[:, 0], np.full(11, np.arctan2(0.8, 0.6))]
    )
    moved = [tie(k, k + 1, turned) for k in range(10)]
    assert spread(moved, turned, (2, 9)) == pytest.approx(spread(CHAIN, STRAIGHT, (2, 9)), rel=1e-6)


def test_a_loop_closure_narrows_it() -> None:
    assert spread([*CHAIN, tie(0, 10, STRAIGHT)], STRAIGHT, (0, 10)) < 0.5 * spread(CHAIN, STRAIGHT, (0, 10))


def test_residuals_widen_what_is_stated_too_narrowly() -> None:
    bent = STRAIGHT.copy()
    bent[1::2, 1] = 0.2  # ten standard deviations to one side and back
    edges = GraphEdges.of(ConstraintList(CHAIN), bent)
    stated = GraphEdges.of(ConstraintList(CHAIN), STRAIGHT)
    assert edges.information[0, 1, 1] == pytest.approx(stated.information[0, 1, 1] / (100.0 / 3.0))
    assert spread(CHAIN, bent, (2, 9)) > 5.0 * spread(CHAIN, STRAIGHT, (2, 9))


def test_a_step_that_nothing_measured_leaves_the_rest_where_it_may_be() -> None:
    torn = [tie(k, k + 1, STRAIGHT) for k in range(10) if k != 5]
    assert spread(torn, STRAIGHT, (2, 4)) < 0.1
    assert spread(torn, STRAIGHT, (2, 9)) > 0.5


def test_many_pairs_spread_as_each_of_them_alone() -> None:
    poses = np.column_stack([0.3 * np.arange(201), np.zeros(201), np.zeros(201)])
    chain = [tie(k - back, k, poses) for k in range(1, 201) for back in (1, 2, 7) if back <= k]
    pairs = np.column_stack([np.arange(0, 160, 2), np.arange(40, 200, 2)])
    together = GraphMotion(GraphEdges.of(ConstraintList(chain), poses), poses).spreads(pairs)
    for at in (0, 30, 79):
        assert together[at] == pytest.approx(spread(chain, poses, (pairs[at, 0], pairs[at, 1])))


def test_one_tear_widens_what_lies_across_it_and_little_else() -> None:
    torn = STRAIGHT.copy()
    torn[6:, 1] = 0.4
    edges = GraphEdges.of(ConstraintList(CHAIN), torn)
    across, besides = GraphMotion(edges, torn).spreads(np.array([[4, 7], [1, 4]]))
    assert across > 1.5 * besides


COUNT = 13
INFORMATION = np.diag([1e4, 1e4, 1e6])
PAIRS = np.array([[0, 12], [2, 9]])


def arc(turn: float) -> Pose:
    """(K, 3) a path of steps of a metre, each turned by so many radians."""
    yaw = turn * np.arange(COUNT)
    steps = np.column_stack([np.cos(yaw), np.sin(yaw)])[:-1]
    return np.column_stack([np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)]), yaw])


def by_wheels(poses: Pose, share: float = 0.0) -> list[Constraint]:
    """Steps of wheels that go a share farther than the map."""
    farther = [1.0 + share, 1.0 + share, 1.0]
    steps = chain(poses, INFORMATION, "odometry")
    return [replace(step, from_pose_to_pose=step.from_pose_to_pose * farther) for step in steps]


def shifts(constraints: list[Constraint], poses: Pose, share: float) -> np.ndarray:
    edges = GraphEdges.of(ConstraintList(constraints), poses)
    return GraphMotion(edges, poses).shifts(slip_errors(edges, share), PAIRS)


@given(st.floats(-0.3, 0.3), st.floats(0.01, 0.1))
def test_a_path_by_wheels_alone_grows_as_they_do(turn: float, share: float) -> None:
    poses = arc(turn)
    ends = between(poses[PAIRS[:, 0]], poses[PAIRS[:, 1]])
    expected = share * np.hypot(ends[:, 0], ends[:, 1])
    np.testing.assert_allclose(shifts(by_wheels(poses), poses, share), expected, rtol=1e-2)


def test_matches_that_hold_do_not_let_it_grow() -> None:
    poses = arc(0.1)
    matches = chain(poses, 1e4 * INFORMATION)
    assert shifts(by_wheels(poses) + matches, poses, 0.05).max() < 0.01


def test_wheels_are_wrong_by_what_the_map_denies_them_where_walls_hold() -> None:
    poses, are_bare = arc(0.0), np.zeros(COUNT, dtype=np.bool_)
    edges = GraphEdges.of(ConstraintList(by_wheels(poses, 0.05)), poses)
    assert slip_share(edges, poses, are_bare) == pytest.approx(0.05 / 1.05)
    are_bare[1:] = True
    assert slip_share(edges, poses, are_bare) == pytest.approx(0.005)


@pytest.mark.parametrize(("metres", "others"), [(0.25, 0), (0.01, COUNT - 1)])
def test_a_part_of_a_step_beside_a_gap_and_a_car_that_is_lifted_show_no_slip(
    metres: float, others: int
) -> None:
    poses = arc(0.0)
    short = Constraint(5, 6, np.array([metres, 0.0, 0.0]), INFORMATION, "odometry")
    steps = [short, *(step for step in by_wheels(poses)[:others] if step.from_keyframe != 5)]
    edges = GraphEdges.of(ConstraintList(steps), poses)
    assert slip_share(edges, poses, np.zeros(COUNT, dtype=np.bool_)) == pytest.approx(0.005)
