import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_table import (
    RangeTable,
    affordable_cells,
    build_range_table,
    choose_viewpoints,
)
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CODES, CONFIG, free_space_of
from tests.localization.floors import table_of as table_on
from tests.localization.furniture import corner, furnished, hall, rectangle
from tests.maps.drives import room


def table_of(grid: OccupancyGrid, megabytes: int) -> RangeTable:
    return table_on(free_space_of(grid), megabytes)


def cells_of(codes: np.ndarray, grid: OccupancyGrid) -> np.ndarray:
    """Of any shape: the ranges that codes stand for."""
    cells: np.ndarray = CODES.decode(codes) / grid.resolution
    return cells


@pytest.mark.parametrize("megabytes", [2, 4, 50])
def test_table_agrees_with_exact_ray_casting(megabytes: int) -> None:
    grid = room()
    table = table_of(grid, megabytes)
    assert (table.headings == 832) == (megabytes == 50)
    chosen = np.random.default_rng(0).choice(len(table.ranges), 300)
    farthest = CODES.longest_range / grid.resolution
    error = cells_of(table.ranges[chosen], grid) - np.minimum(cast_on(grid, table, chosen), farthest)
    assert np.mean(np.abs(error) > 3.0) < 0.02
    assert np.mean(np.abs(error) > 1.5) < 0.05
    assert abs(np.mean(error[np.abs(error) < 3.0])) < 0.1


def test_straight_at_a_wall_to_the_cell() -> None:
    cells = np.full((41, 41), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    table = table_of(grid, 10)
    row = table.ranges[table.cell_index[20, 10]]
    assert row[0] in (29, 30)
    assert row[table.headings // 2] == 255
    assert row[table.headings // 4] == 255


def test_no_ray_slips_through_a_diagonal_wall() -> None:
    cells = np.full((60, 60), FREE, dtype=np.int8)
    cells[np.arange(60), np.arange(60)] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, IDENTITY)
    table = table_of(grid, 10)
    row = cells_of(table.ranges[table.cell_index[20, 40]], grid)
    towards_wall = row[np.arange(table.headings * 3 // 8 - 37, table.headings * 3 // 8 + 37)]
    assert towards_wall.max() < 25


def test_a_map_too_large_for_the_memory_gets_no_table_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    huge = OccupancyGrid(np.full((200, 200), FREE, dtype=np.int8), 0.1, IDENTITY)
    assert build_range_table(free_space_of(huge), 1, CONFIG.range_table) is CODES
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


def expected_from(table: RangeTable, grid: OccupancyGrid, viewpoints: np.ndarray) -> np.ndarray:
    """(N, headings) cells, from some viewpoints (N,), by number."""
    return cells_of(table.ranges[viewpoints], grid)


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
@settings(max_examples=8)
@given(center=centers)
def test_from_inside_a_lone_obstacle_all_rays_end_where_they_would_without_it(
    shape: str, yaw: float, center: np.ndarray
) -> None:
    grid, mask = placed(shape, center, yaw)
    table = table_of(grid, 50)
    inside = viewpoints_of(table, mask)
    error = np.abs(expected_from(table, grid, inside) - cast_on(hall(), table, inside))
    assert np.mean(error > 1.5) < 0.01
    assert np.max(error) < 6.0


@SHAPES
@settings(max_examples=8)
@given(center=centers, yaw=angles)
def test_from_inside_an_obstacle_rays_end_behind_it_unless_they_come_back_to_it(
    shape: str, center: np.ndarray, yaw: float
) -> None:
    """Along a slanting side, which is a staircase of cells, and from arm to arm of a corner, some do."""
    grid, mask = placed(shape, center, yaw)
    table = table_of(grid, 50)
    inside = viewpoints_of(table, mask)
    expected, bare = expected_from(table, grid, inside), cast_on(hall(), table, inside)
    is_stopped = expected < bare - 6.0
    assert is_stopped.mean() < (0.18 if shape == "corner" else 0.08)
    assert np.all(expected[is_stopped] < 2.4 / grid.resolution)
    assert np.all(expected <= bare + 6.0)


@SHAPES
@settings(max_examples=8)
@given(center=centers, yaw=angles)
def test_from_outside_rays_end_at_a_lone_obstacle(shape: str, center: np.ndarray, yaw: float) -> None:
    grid, mask = placed(shape, center, yaw)
    table = table_of(grid, 50)
    outside = viewpoints_of(table, (grid.cells == FREE) & ~mask)
    outside = outside[np.random.default_rng(0).choice(len(outside), 200)]
    expected = expected_from(table, grid, outside)
    exact, bare = (cast_on(place, table, outside) for place in (grid, hall()))
    is_shadowed = exact < bare - 5.0
    assert is_shadowed.any()
    assert np.mean(np.abs(expected - exact)[is_shadowed] > 3.0) < 0.05
    assert np.mean(np.abs(expected - exact) > 3.0) < 0.02


def test_rays_do_not_go_through_a_wall_from_an_obstacle_beside_it() -> None:
    cells = hall().cells.copy()
    cells[:, 60:62] = OCCUPIED
    cells[40:44, 50:57] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, IDENTITY)
    table = table_of(grid, 50)
    row = cells_of(table.ranges[table.cell_index[42, 53]], grid)
    assert row[0] == pytest.approx(7, abs=1)
    assert row[table.headings // 2] == pytest.approx(51, abs=1)


def test_rays_from_one_lone_obstacle_end_at_the_next() -> None:
    cells = hall().cells.copy()
    cells[40:44, 30:35] = OCCUPIED
    cells[40:44, 50:55] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, IDENTITY)
    table = table_of(grid, 50)
    row = cells_of(table.ranges[table.cell_index[42, 32]], grid)
    assert row[0] == pytest.approx(18, abs=1)
    assert row[table.headings // 2] == pytest.approx(31, abs=1)


def test_as_many_cells_as_are_affordable_get_all_headings() -> None:
    side = int(np.sqrt(affordable_cells(2, CONFIG.range_table)))
    assert side == 98
    grid = OccupancyGrid(np.full((side, side), FREE, dtype=np.int8), 0.1, IDENTITY)
    assert table_of(grid, 2).headings == CONFIG.range_table.headings


@pytest.mark.parametrize("resolution", [0.01, 0.02, 0.1, 0.25])
def test_ranges_are_metres_at_every_resolution(resolution: float) -> None:
    """The wall ahead is 12 m away, and what is beyond 32 m is not seen."""
    cells = np.full((4, round(44.0 / resolution)), FREE, dtype=np.int8)
    cells[:, round(42.0 / resolution)] = OCCUPIED
    table = table_of(OccupancyGrid(cells, resolution, IDENTITY), 100)
    ahead = CODES.decode(table.ranges[table.cell_index[1]][:, 0])
    assert ahead[round(30.0 / resolution)] == pytest.approx(12.0, abs=0.1 + resolution)
    assert ahead[round(2.0 / resolution)] == 32.0


def free_space_with(kinds: np.ndarray) -> FreeSpace:
    """From kinds (rows, columns): 0 where no car can be, 1 open, 2 an obstacle that can be moved."""
    grid = OccupancyGrid(np.full(kinds.shape, FREE, dtype=np.int8), 0.1, IDENTITY)
    return FreeSpace(grid, kinds == 1, kinds == 2)


def test_four_open_cells_are_seen_from_their_middle() -> None:
    index, viewpoints = choose_viewpoints(free_space_with(np.ones((2, 4), dtype=np.int64)))
    np.testing.assert_array_equal(index, [[0, 0, 1, 1], [0, 0, 1, 1]])
    np.testing.assert_array_equal(viewpoints, [[1.0, 1.0], [1.0, 3.0]])


def test_fewer_are_seen_from_the_middle_of_the_first() -> None:
    index, viewpoints = choose_viewpoints(free_space_with(np.array([[0, 1], [1, 1]])))
    np.testing.assert_array_equal(index, [[-1, 0], [0, 0]])
    np.testing.assert_array_equal(viewpoints, [[0.5, 1.5]])


def test_cells_on_both_sides_of_a_slanting_wall_have_views_of_their_own() -> None:
    index, viewpoints = choose_viewpoints(free_space_with(np.array([[1, 0], [0, 1]])))
    assert index[0, 0] != index[1, 1]
    np.testing.assert_array_equal(viewpoints[index[1, 1]], [1.5, 1.5])


@given(st.integers(0, 10**9))
def test_each_cell_is_near_a_viewpoint_of_its_kind(seed: int) -> None:
    kinds = np.random.default_rng(seed).choice(3, (7, 9), p=[0.2, 0.6, 0.2])
    index, viewpoints = choose_viewpoints(free_space_with(kinds))
    np.testing.assert_array_equal(index >= 0, kinds > 0)
    assert set(index[index >= 0]) == set(range(len(viewpoints)))
    row, column = np.nonzero(kinds)
    offsets = viewpoints[index[row, column]] - np.column_stack([row, column]) - 0.5
    assert np.abs(offsets).max(initial=0.0) <= 1.0
    seen_from = np.ceil(viewpoints[index[row, column]]).astype(np.int64) - 1
    np.testing.assert_array_equal(kinds[tuple(seen_from.T)], kinds[row, column])
