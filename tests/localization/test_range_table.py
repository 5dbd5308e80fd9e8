from functools import cache

import numpy as np
import pytest
from drives import room
from furniture import corner, furnished, hall, rectangle
from hypothesis import given, settings
from hypothesis import strategies as st

from localization.free_space import find_free_space
from localization.range_codes import CELLS_OF_CODE
from localization.range_table import RangeTable, build_range_table
from maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from maps.ray_casting import cast_ray_fan
from maps.se2 import IDENTITY


def table_of(grid: OccupancyGrid, megabytes: int) -> RangeTable:
    table = build_range_table(find_free_space(grid, 10**6), megabytes)
    assert table is not None
    return table


@pytest.mark.parametrize("headings_at_least", [320, 192, 128])
def test_table_agrees_with_exact_ray_casting(headings_at_least: int) -> None:
    grid = room()
    cells = np.count_nonzero(grid.cells == FREE)
    table = table_of(grid, -(-cells * headings_at_least // 10**6))
    assert table.headings == headings_at_least
    chosen = np.random.default_rng(0).choice(len(table.ranges), 300)
    centres = grid.center_of(np.argwhere(table.cell_index >= 0)[chosen])
    poses = np.column_stack([centres, np.full(300, grid.map_from_grid[2])])
    bearings = 2 * np.pi * np.arange(table.headings) / table.headings
    exact = np.minimum(cast_ray_fan(grid, poses, bearings, 100.0) / grid.resolution, 720.0)
    error = CELLS_OF_CODE[table.ranges[chosen]] - exact
    assert np.mean(np.abs(error) > 3.0) < 0.02
    assert np.mean(np.abs(error) > 1.5) < 0.05
    assert abs(np.mean(error[np.abs(error) < 3.0])) < 0.1


def test_straight_at_a_wall_to_the_cell() -> None:
    cells = np.full((41, 41), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    table = table_of(OccupancyGrid(cells, 0.5, IDENTITY), 10)
    row = table.ranges[table.cell_index[20, 10]]
    assert row[0] in (29, 30)
    assert row[table.headings // 2] == 255
    assert row[table.headings // 4] == 255


def test_no_ray_slips_through_a_diagonal_wall() -> None:
    cells = np.full((60, 60), FREE, dtype=np.int8)
    cells[np.arange(60), np.arange(60)] = OCCUPIED
    table = table_of(OccupancyGrid(cells, 0.1, IDENTITY), 10)
    row = table.ranges[table.cell_index[20, 40]]
    towards_wall = row[np.arange(table.headings * 3 // 8 - 37, table.headings * 3 // 8 + 37)]
    assert towards_wall.max() < 25


def test_a_map_too_large_for_the_memory_gets_no_table_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    huge = OccupancyGrid(np.full((200, 200), FREE, dtype=np.int8), 0.1, IDENTITY)
    assert build_range_table(find_free_space(huge, 10**6), 1) is None
    assert "table_megabytes is 1" in caplog.text
    caplog.clear()
    assert table_of(huge, 6).headings == 128
    assert "128 headings instead of 320" in caplog.text


def placed(shape: str, center: np.ndarray, yaw: float) -> tuple[OccupancyGrid, np.ndarray]:
    """The hall with an obstacle, and the cells (rows, columns) that it takes or encloses."""
    grid = hall()
    if shape == "corner":
        mask = corner(grid, yaw)
        return furnished(grid, mask), mask
    mask = rectangle(grid, center, 1.8, 1.1, yaw)
    obstructed = furnished(grid, mask)
    if shape == "outline":
        obstructed.cells[rectangle(grid, center, 1.4, 0.7, yaw)] = UNKNOWN
    return obstructed, mask


def told_by(table: RangeTable, cells: np.ndarray) -> np.ndarray:
    """(N, headings) cells, from some (N, 2)."""
    told: np.ndarray = CELLS_OF_CODE[table.ranges[table.cell_index[tuple(cells.T)]]]
    return told


def cast_on(grid: OccupancyGrid, cells: np.ndarray, headings: int) -> np.ndarray:
    """(N, headings) the same by rays cast one by one."""
    poses = np.column_stack([grid.center_of(cells), np.full(len(cells), grid.map_from_grid[2])])
    bearings = 2 * np.pi * np.arange(headings) / headings
    return np.asarray(cast_ray_fan(grid, poses, bearings, 100.0) / grid.resolution)


@cache
def bare_table() -> RangeTable:
    return table_of(hall(), 50)


SHAPES = pytest.mark.parametrize("shape", ["box", "outline", "corner"])
centers = st.tuples(st.floats(3.0, 7.0), st.floats(3.0, 5.0)).map(np.array)
angles = st.floats(-np.pi, np.pi)


@pytest.mark.parametrize("shape", ["box", "outline"])
@pytest.mark.parametrize("yaw", [0.0, np.pi / 2])
@settings(deadline=None, max_examples=8)
@given(center=centers)
def test_from_inside_a_lone_obstacle_all_rays_end_where_they_would_without_it(
    shape: str, yaw: float, center: np.ndarray
) -> None:
    grid, mask = placed(shape, center, yaw)
    cells = np.argwhere(mask)
    told = told_by(table_of(grid, 50), cells)
    np.testing.assert_array_equal(told, told_by(bare_table(), cells))
    exact = cast_on(hall(), cells, told.shape[1])
    assert np.mean(np.abs(told - exact) > 1.5) < 0.01
    assert np.max(np.abs(told - exact)) < 5.0


@SHAPES
@settings(deadline=None, max_examples=8)
@given(center=centers, yaw=angles)
def test_from_inside_an_obstacle_rays_end_behind_it_unless_they_come_back_to_it(
    shape: str, center: np.ndarray, yaw: float
) -> None:
    """Along a slanting side, which is a staircase of cells, and from arm to arm of a corner, some do."""
    grid, mask = placed(shape, center, yaw)
    cells = np.argwhere(mask)
    told, bare = told_by(table_of(grid, 50), cells), told_by(bare_table(), cells)
    is_stopped = told != bare
    assert is_stopped.mean() < (0.18 if shape == "corner" else 0.08)
    assert np.all(told[is_stopped] < bare[is_stopped])
    assert np.all(told[is_stopped] < 2.4 / grid.resolution)


@SHAPES
@settings(deadline=None, max_examples=8)
@given(center=centers, yaw=angles)
def test_from_outside_rays_end_at_a_lone_obstacle(shape: str, center: np.ndarray, yaw: float) -> None:
    grid, mask = placed(shape, center, yaw)
    outside = np.argwhere((grid.cells == FREE) & ~mask)
    cells = outside[np.random.default_rng(0).choice(len(outside), 200)]
    told = told_by(table_of(grid, 50), cells)
    exact, bare = (cast_on(place, cells, told.shape[1]) for place in (grid, hall()))
    is_shadowed = exact < bare - 5.0
    assert is_shadowed.any()
    assert np.mean(np.abs(told - exact)[is_shadowed] > 3.0) < 0.05
    assert np.mean(np.abs(told - exact) > 3.0) < 0.02


def test_rays_do_not_go_through_a_wall_from_an_obstacle_beside_it() -> None:
    cells = hall().cells.copy()
    cells[:, 60:62] = OCCUPIED
    cells[40:44, 50:57] = OCCUPIED
    table = table_of(OccupancyGrid(cells, 0.1, IDENTITY), 50)
    row = CELLS_OF_CODE[table.ranges[table.cell_index[42, 53]]]
    assert row[0] == pytest.approx(7, abs=1)
    assert row[table.headings // 2] == pytest.approx(51, abs=1)


def test_rays_from_one_lone_obstacle_end_at_the_next() -> None:
    cells = hall().cells.copy()
    cells[40:44, 30:35] = OCCUPIED
    cells[40:44, 50:55] = OCCUPIED
    table = table_of(OccupancyGrid(cells, 0.1, IDENTITY), 50)
    row = CELLS_OF_CODE[table.ranges[table.cell_index[42, 32]]]
    assert row[0] == pytest.approx(18, abs=1)
    assert row[table.headings // 2] == pytest.approx(31, abs=1)
