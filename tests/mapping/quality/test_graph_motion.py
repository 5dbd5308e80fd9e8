"""How a pose graph moves where its constraints err as they state, against what is known in closed form."""

import numpy as np
import pytest

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.graph_motion import GraphMotion
from racecar.maps.geometry.se2 import between

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
