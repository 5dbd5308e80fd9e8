"""Outdoors: ways between buildings, trees and hedges, and across a field where nothing stands for 30 m."""

from dataclasses import replace
from math import radians

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from racecar.pipelines.simulation.plans.canvas import FloorCanvas

_LOWER, _UPPER, _RESOLUTION = (0.0, 0.0), (172.0, 122.0), 0.1
"""Metres; cells of 10 cm, since nothing outdoors is straight to less."""
_WAYS = (
    ((20.0, 20.0), (46.0, 18.5), (70.0, 20.0), (71.0, 42.0), (69.0, 62.0), (44.0, 60.5), (20.0, 62.0),
     (18.5, 41.0), (20.0, 20.0)),
    ((70.0, 20.0), (110.0, 21.0), (150.0, 24.0), (152.0, 60.0), (148.0, 95.0), (110.0, 99.0), (71.0, 97.0),
     (69.0, 62.0)),
)  # fmt: skip
"""Corners of the lanes: a round between buildings, and one about the field that leaves and joins it."""
_WIDTH = 3.0
_TREES = 110
_LANE_TO_TREE = (2.4, 11.0)
"""Metres from the middle of a lane within which trees stand."""


def draw_campus() -> OccupancyGrid:
    """The campus, 170 m long; a car drives on the ways only, and the lawn beside them is unknown.

    The map's origin is on the southern way between the buildings.
    """
    ways = FloorCanvas(_LOWER, _UPPER, _RESOLUTION)
    lanes = [_along(corners) for corners in _WAYS]
    ways.open_lane(np.concatenate(lanes), _WIDTH)
    plan = FloorCanvas(_LOWER, _UPPER, _RESOLUTION)
    plan.open_box(*_LOWER, *_UPPER)
    _draw_buildings(plan)
    generator = np.random.default_rng(0)
    _draw_hedges(plan, generator)
    _plant_trees(plan, np.concatenate(lanes), generator)
    grid = plan.finish(origin=(30.0, 19.5))
    lawn = (ways.finish().cells != FREE) & (grid.cells == FREE)
    return replace(grid, cells=np.where(lawn, np.int8(UNKNOWN), grid.cells))


def _draw_buildings(plan: FloorCanvas) -> None:
    plan.solid_box(26.0, 25.0, 62.0, 34.0)
    for x in (30.0, 37.5, 45.0, 54.0):
        plan.open_box(x, 24.0, x + 2.6, 25.8)  # entrances
    plan.open_box(61.0, 28.0, 62.5, 31.0)
    plan.solid_box(27.0, 43.0, 50.0, 55.0)
    plan.open_box(33.0, 50.0, 41.0, 56.0)  # a court
    plan.solid_table(58.0, 50.0, 7.0, 4.0, radians(20))
    plan.solid_box(80.0, 105.0, 118.0, 116.0)
    for x in (84.0, 95.0, 104.0):
        plan.open_box(x, 104.0, x + 3.0, 106.5)
    plan.solid_table(161.0, 68.0, 10.0, 18.0, radians(-8))
    plan.solid_box(6.0, 70.0, 24.0, 82.0)


def _draw_hedges(plan: FloorCanvas, generator: np.random.Generator) -> None:
    plan.solid_thicket(12.5, 24.0, 13.4, 58.0, generator)
    plan.solid_thicket(24.0, 12.6, 44.0, 13.6, generator)
    plan.solid_thicket(75.4, 30.0, 76.2, 56.0, generator)
    plan.solid_thicket(120.0, 102.4, 144.0, 103.4, generator)
    plan.solid_thicket(90.0, 91.0, 104.0, 91.8, generator)
    plan.solid_thicket(156.6, 28.0, 157.6, 50.0, generator)


def _plant_trees(plan: FloorCanvas, lane: NDArray[np.float64], generator: np.random.Generator) -> None:
    """Trunks beside the ways, but none along the straight way over the field."""
    in_field = (lane[:, 0] > 78.0) & (lane[:, 0] < 146.0) & (lane[:, 1] < 40.0)
    beside = lane[~in_field]
    planted = 0
    while planted < _TREES:
        place = beside[generator.integers(len(beside))] + generator.uniform(-1.0, 1.0, 2) * _LANE_TO_TREE[1]
        if np.hypot(*(lane - place).T).min() >= _LANE_TO_TREE[0]:
            plan.solid_disc(place[0], place[1], generator.uniform(0.1, 0.3))
            planted += 1


def _along(corners: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """(N, 2) points half a cell apart."""
    points = np.array(corners)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    evenly = np.arange(0.0, along[-1], _RESOLUTION / 2)
    return np.column_stack([np.interp(evenly, along, axis) for axis in points.T])
