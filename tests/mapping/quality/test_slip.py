"""The map as it would be were wheels wrong everywhere as where walls hold, on paths in closed form."""

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
from tests.mapping.quality.plain_maps import chain

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
