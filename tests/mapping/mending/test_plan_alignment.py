"""A floor plan of the ring that a drive saw, drawn in its own frame and scale."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.mapping.mending.floor_plan import FloorPlan, lines_of
from racecar.mapping.mending.plan_alignment import aligned_by_points, refined_on_walls
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points, wrap_angle
from tests.mapping.sessions import BARE_RING, RING, path, session

DRIVEN = session(RING, path(0.0, 32.0), np.array([0.3, -0.2, 0.1]), np.zeros(3))
MAP_FROM_WORLD = np.array([0.3, -0.2, 0.1])
CORNERS = np.array([(-6.0, -4.0), (6.0, 4.0), (6.0, -4.0)])


def drawn(plan_from_world: Pose, metres_per_unit: float, walls: NDArray[np.float64] = RING) -> FloorPlan:
    lines = transform_points(plan_from_world, walls.reshape(-1, 2)).reshape(-1, 2, 2) / metres_per_unit
    return FloorPlan("plan.dxf", lines, np.zeros((len(lines), 2)), "unit of the drawing")


def corners(
    plan_from_world: Pose, metres_per_unit: float, count: int = 2
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    in_plan = transform_points(plan_from_world, CORNERS[:count]) / metres_per_unit
    return in_plan, transform_points(MAP_FROM_WORLD, CORNERS[:count])


def error(found: Pose, plan_from_world: Pose) -> tuple[float, float]:
    """Metres, farthest off along the drive, and radians."""
    right = compose(plan_from_world, inverse(MAP_FROM_WORLD))
    there = [transform_points(pose, DRIVEN.map_from_base[:, :2]) for pose in (found, right)]
    return float(np.hypot(*(there[0] - there[1]).T).max()), abs(float(wrap_angle(found[2] - right[2])))


frames = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-math.pi, math.pi))
scales = st.floats(1e-3, 10.0)


@given(frames, scales, st.integers(2, 3))
def test_points_give_frame_and_scale(frame: tuple[float, float, float], scale: float, count: int) -> None:
    found = aligned_by_points(drawn(np.array(frame), scale), *corners(np.array(frame), scale, count))
    assert found.metres_per_unit == pytest.approx(scale, rel=1e-9)
    assert max(error(found.plan_from_map, np.array(frame))) < 1e-6


@settings(max_examples=8, deadline=None)
@given(frames, st.floats(0.01, 2.0), st.integers(0, 1000))
def test_walls_correct_what_people_click(frame: tuple[float, float, float], scale: float, seed: int) -> None:
    in_plan, in_map = corners(np.array(frame), scale)
    clicked = in_map + np.random.default_rng(seed).uniform(-0.2, 0.2, (2, 2))
    found = refined_on_walls(drawn(np.array(frame), scale), DRIVEN, in_plan, clicked)
    metres, radians = error(found.plan_from_map, np.array(frame))
    assert metres < 0.03 and radians < math.radians(0.2)
    assert found.metres_per_unit == pytest.approx(scale, rel=0.005)
    assert found.share > 0.9 and found.residual < 0.05


def test_a_plan_without_furniture_is_enough() -> None:
    frame = np.array([4.0, 5.0, 0.5])
    in_plan, in_map = corners(frame, 0.02)
    found = refined_on_walls(drawn(frame, 0.02, BARE_RING), DRIVEN, in_plan, in_map + np.array([0.1, -0.1]))
    assert error(found.plan_from_map, frame)[0] < 0.03


def test_the_faces_of_thick_walls_lie_where_the_laser_saw_them() -> None:
    frame, thick = np.zeros(3), 0.2
    faces = lines_of([np.array([(-6, -4), (6, -4), (6, 4), (-6, 4), (-6, -4)], dtype=float)])
    behind = lines_of([np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * [6 + thick, 4 + thick]])
    block = lines_of([np.array([(-4, -2), (4, -2), (4, 2), (-4, 2), (-4, -2)], dtype=float)])
    inwards = np.array([(0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)])
    plan = FloorPlan(
        "plan.png",
        np.concatenate([faces, behind, block]),
        np.concatenate([inwards, -inwards, -inwards]),
        "pixel",
    )
    in_plan, in_map = corners(frame, 1.0)
    found = refined_on_walls(plan, DRIVEN, in_plan * (1 + thick / 6), in_map)  # on the wrong face
    assert error(found.plan_from_map, frame)[0] < 0.03
    assert found.metres_per_unit == pytest.approx(1.0, rel=0.005)


def test_another_floor_is_refused() -> None:
    frame = np.zeros(3)
    in_plan, in_map = corners(frame, 1.0)
    with pytest.raises(RefusedConstraintError, match=r"% of the map's walls lie on those of plan\.dxf"):
        refined_on_walls(drawn(frame, 1.0, RING @ [[0.5, 0.5], [-0.5, 0.5]]), DRIVEN, in_plan, in_map)


def test_a_plan_full_of_lines_fits_everything_and_is_refused() -> None:
    at = np.arange(-8.0, 8.0, 0.15)
    hatched = [np.stack([[x, -8.0], [x, 8.0]]) for x in at] + [np.stack([[-8.0, y], [8.0, y]]) for y in at]
    in_plan, in_map = corners(np.zeros(3), 1.0)
    with pytest.raises(RefusedConstraintError, match="of the map's walls"):
        refined_on_walls(drawn(np.zeros(3), 1.0, np.array(hatched)), DRIVEN, in_plan, in_map)


@pytest.mark.parametrize(
    ("in_plan", "in_map", "why"),
    [
        ([[0.0, 0.0]], [[0.0, 0.0]], "two points"),
        ([[1.0, 2.0], [1.0, 2.0]], [[0.0, 0.0], [5.0, 0.0]], "two points"),
        ([[1.0, 2.0], [3.0, 2.0]], [[5.0, 0.0], [5.0, 0.0]], "two points"),
        ([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]], [[0.0, 0.0], [9.0, 0.0], [0.0, -9.0]], "contradict"),
    ],
)
def test_points_that_say_nothing_or_contradict_each_other(
    in_plan: list[list[float]], in_map: list[list[float]], why: str
) -> None:
    with pytest.raises(RefusedConstraintError, match=why):
        aligned_by_points(drawn(np.zeros(3), 1.0), np.array(in_plan), np.array(in_map))


def test_lines_are_drawn_where_they_are() -> None:
    grid = drawn(np.array([3.0, 4.0, 0.0]), 0.5).drawn(0.5, 0.05)
    places = grid.center_of(np.argwhere(grid.cells > 0))
    np.testing.assert_allclose(places.min(axis=0), [-3.0, 0.0], atol=0.05)
    np.testing.assert_allclose(places.max(axis=0), [9.0, 8.0], atol=0.05)
