import numpy as np
import pytest
from drives import room

from localization.free_space import find_free_space
from localization.range_codes import CELLS_OF_CODE
from localization.range_table import RangeTable, build_range_table
from maps.errors import UserError
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


def test_unreachable_specks_and_the_floor_around_a_track_are_left_out() -> None:
    cells = np.full((200, 200), FREE, dtype=np.int8)
    cells[50:150, 50:150] = OCCUPIED
    cells[60:140, 60:140] = FREE
    cells[54:56, 54:56] = FREE
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    assert find_free_space(grid, 10**6).cell_count == 80 * 80 + 200 * 200 - 100 * 100
    assert find_free_space(grid, 10_000).cell_count == 80 * 80


def test_unknown_floor_beside_free_floor_counts_as_a_place_but_not_what_lies_behind_a_wall() -> None:
    cells = np.full((100, 100), UNKNOWN, dtype=np.int8)
    cells[20:80, 20:50] = FREE
    cells[10:90, 49:51] = OCCUPIED
    is_open = find_free_space(OccupancyGrid(cells, 0.1, IDENTITY), 10**6).is_open
    assert is_open[50, 12]
    assert not is_open[50, 5]
    assert not is_open[50, 52]


def test_a_map_without_floor_is_a_sentence() -> None:
    blocked = OccupancyGrid(np.full((20, 20), OCCUPIED, dtype=np.int8), 0.1, IDENTITY)
    with pytest.raises(UserError, match="no free cells"):
        find_free_space(blocked, 10**6)


def test_a_map_too_large_for_the_memory_gets_no_table_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    huge = OccupancyGrid(np.full((200, 200), FREE, dtype=np.int8), 0.1, IDENTITY)
    assert build_range_table(find_free_space(huge, 10**6), 1) is None
    assert "table_megabytes is 1" in caplog.text
    caplog.clear()
    assert table_of(huge, 6).headings == 128
    assert "128 headings instead of 320" in caplog.text
