import numpy as np
import pytest
from drives import room
from furniture import corner, furnished, hall, rectangle
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, FARTHEST
from racecar.localization.floor.range_table.range_table import (
    HEADINGS,
    RangeTable,
    affordable_cells,
    build_range_table,
)
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan


def table_of(grid: OccupancyGrid, megabytes: int) -> RangeTable:
    table = build_range_table(find_free_space(grid, 10**6), megabytes)
    assert table is not None
    return table


@pytest.mark.parametrize("megabytes", [2, 4, 50])
def test_table_agrees_with_exact_ray_casting(megabytes: int) -> None:
    grid = room()
    table = table_of(grid, megabytes)
    assert (table.headings == 832) == (megabytes == 50)
    chosen = np.random.default_rng(0).choice(len(table.ranges), 300)
    error = CELLS_OF_CODE[table.ranges[chosen]] - np.minimum(cast_on(grid, table, chosen), FARTHEST)
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
    assert table_of(huge, 2).headings == 192
    assert "192 headings instead of 832" in caplog.text


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


def told_from(table: RangeTable, viewpoints: np.ndarray) -> np.ndarray:
    """(N, headings) cells, from some viewpoints (N,), by number."""
    told: np.ndarray = CELLS_OF_CODE[table.ranges[viewpoints]]
    return told


def viewpoints_of(table: RangeTable, mask: np.ndarray) -> np.ndarray:
    """(N,) numbers of the viewpoints for the cells of a mask."""
    return np.unique(table.cell_index[mask & (table.cell_index >= 0)])


def cast_on(grid: OccupancyGrid, table: RangeTable, viewpoints: np.ndarray) -> np.ndarray:
    """(N, headings) cells from some viewpoints (N,), by rays cast one by one."""
    places = grid.center_of(table.viewpoints[viewpoints] - 0.5)
    poses = np.column_stack([places, np.full(len(places), grid.map_from_grid[2])])
    bearings = 2 * np.pi * np.arange(table.headings) / table.headings
    return np.asarray(cast_ray_fan(grid, poses, bearings, 100.0) / grid.resolution)


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
    table = table_of(grid, 50)
    inside = viewpoints_of(table, mask)
    error = np.abs(told_from(table, inside) - cast_on(hall(), table, inside))
    assert np.mean(error > 1.5) < 0.01
    assert np.max(error) < 6.0


@SHAPES
@settings(deadline=None, max_examples=8)
@given(center=centers, yaw=angles)
def test_from_inside_an_obstacle_rays_end_behind_it_unless_they_come_back_to_it(
    shape: str, center: np.ndarray, yaw: float
) -> None:
    """Along a slanting side, which is a staircase of cells, and from arm to arm of a corner, some do."""
    grid, mask = placed(shape, center, yaw)
    table = table_of(grid, 50)
    inside = viewpoints_of(table, mask)
    told, bare = told_from(table, inside), cast_on(hall(), table, inside)
    is_stopped = told < bare - 6.0
    assert is_stopped.mean() < (0.18 if shape == "corner" else 0.08)
    assert np.all(told[is_stopped] < 2.4 / grid.resolution)
    assert np.all(told <= bare + 6.0)


@SHAPES
@settings(deadline=None, max_examples=8)
@given(center=centers, yaw=angles)
def test_from_outside_rays_end_at_a_lone_obstacle(shape: str, center: np.ndarray, yaw: float) -> None:
    grid, mask = placed(shape, center, yaw)
    table = table_of(grid, 50)
    outside = viewpoints_of(table, (grid.cells == FREE) & ~mask)
    outside = outside[np.random.default_rng(0).choice(len(outside), 200)]
    told = told_from(table, outside)
    exact, bare = (cast_on(place, table, outside) for place in (grid, hall()))
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


def test_as_many_cells_as_are_affordable_get_all_headings() -> None:
    side = int(np.sqrt(affordable_cells(2)))
    assert side == 98
    grid = OccupancyGrid(np.full((side, side), FREE, dtype=np.int8), 0.1, IDENTITY)
    assert table_of(grid, 2).headings == HEADINGS
