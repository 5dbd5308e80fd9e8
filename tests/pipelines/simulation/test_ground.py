"""A laser that looks down, or drives over hills, sees the ground where geometry says."""

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.pipelines.simulation.ground import Ground, draw_heights
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX

MIDDLE = np.array([20.0, 20.0, 0.3])
TILT = 2.0
AHEAD = UST_10LX.height / np.sin(np.radians(TILT))
LEVEL = np.abs(np.cos(UST_10LX.bearings)) < 1e-9


def plain(cell: int = FREE) -> OccupancyGrid:
    """40 x 40 m."""
    return OccupancyGrid(np.full((400, 400), cell, dtype=np.int8), 0.1, np.zeros(3))


def seen(
    grid: OccupancyGrid, heights: NDArray[np.float64], pose: Pose = MIDDLE, tilt: float = TILT
) -> NDArray[np.float64]:
    ground = Ground(grid, heights, np.random.default_rng(0))
    return ground.cast(np.tile(pose, (UST_10LX.beams, 1)), UST_10LX, tilt)


def flat(grid: OccupancyGrid) -> NDArray[np.float64]:
    return np.zeros(grid.cells.shape)


def test_on_a_flat_floor_a_tilted_laser_sees_an_arc_that_moves_along() -> None:
    expected = AHEAD / np.cos(UST_10LX.bearings)
    near = np.abs(UST_10LX.bearings) < np.radians(60.0)
    for pose in (MIDDLE, np.array([15.0, 22.0, -2.0])):
        ranges = seen(plain(), flat(plain()), pose)
        assert np.abs(ranges[near] / expected[near] - 1.0).mean() < 0.03
        assert ranges[np.abs(UST_10LX.bearings) > np.radians(91.0)].min() == np.inf


def test_a_level_laser_sees_no_flat_floor() -> None:
    assert np.all(np.isinf(seen(plain(), flat(plain()), tilt=0.0)))


def test_what_is_met_first_is_seen_a_wall_or_the_floor() -> None:
    grid = plain()
    wall = grid.cell_of([[20.0 + BASE_FROM_LASER[0] + 3.0, 20.0]])[0, 1]
    grid.cells[:, wall] = OCCUPIED
    pose = np.array([20.0, 20.0, 0.0])
    assert seen(grid, flat(grid), pose)[540] == pytest.approx(3.0, abs=0.1)
    assert seen(grid, flat(grid), pose, tilt=6.0)[540] == pytest.approx(1.435, rel=0.1)


def test_a_ramp_is_seen_from_its_foot_and_no_more_from_on_it() -> None:
    grid = plain()
    x = grid.resolution * (np.arange(400) + 0.5)
    ramp = np.broadcast_to(0.1 * np.clip(x - 22.0, 0.0, None), (400, 400))
    at_foot, on_it = (seen(grid, ramp, np.array([x, 20.0, 0.0]), tilt=0.0)[540] for x in (18.0, 26.0))
    assert at_foot == pytest.approx(22.0 - 18.27 + 1.5, abs=0.2)
    assert np.isinf(on_it)


def test_a_car_that_leans_sees_the_ground_on_its_lower_side() -> None:
    grid = plain()
    y = grid.resolution * (np.arange(400) + 0.5)
    bank = np.broadcast_to(np.where(np.abs(y - 20.0) < 1.0, 0.1 * (y - 20.0), 0.0)[:, None], (400, 400))
    ranges = seen(grid, bank, np.array([20.0, 20.0, 0.0]), tilt=0.0)
    right, left = UST_10LX.bearings < -0.5, UST_10LX.bearings > 0.5
    assert np.isfinite(ranges[right]).mean() > 0.9
    assert np.isinf(ranges[left]).all()


def test_a_kerb_is_seen_before_the_lawn_behind_it() -> None:
    grid = plain()
    grid.cells[:, 222:] = UNKNOWN
    heights = draw_heights(grid, 0.0, 0.1, np.random.default_rng(0))
    ahead = seen(grid, heights, np.array([20.0, 20.0, 0.0]))[540]
    assert ahead == pytest.approx(22.2 - 20.27, abs=0.15)


def test_hills_are_as_steep_as_asked_for_at_most() -> None:
    grid = plain()
    heights = draw_heights(grid, 0.08, 0.0, np.random.default_rng(1))
    slope = np.hypot(*np.gradient(heights, grid.resolution))
    assert 0.02 < slope.max() < 0.0801
    assert np.ptp(draw_heights(grid, 0.0, 0.0, np.random.default_rng(1))) == 0.0
