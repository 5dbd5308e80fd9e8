"""Walls become lines along their middle."""

import numpy as np

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.wall_lines import wall_lines

RESOLUTION = 0.05
ORIGIN = np.array([1.0, -2.0, 0.3])


def grid_with(*blocks: tuple[slice, slice]) -> OccupancyGrid:
    cells = np.zeros((120, 160), dtype=np.int8)
    for block in blocks:
        cells[block] = 100
    return OccupancyGrid(cells, RESOLUTION, ORIGIN)


def length(line: np.ndarray) -> float:
    return float(np.sum(np.hypot(*np.diff(line, axis=0).T)))


def test_a_thick_straight_wall_is_one_line_along_its_middle() -> None:
    grid = grid_with((slice(50, 53), slice(20, 120)))
    (line,) = wall_lines(grid)
    assert len(line) == 2
    ends = grid.center_of([[51, 20], [51, 119]])
    if np.hypot(*(line[0] - ends[0])) > 1.0:
        line = line[::-1]
    np.testing.assert_allclose(line, ends, atol=2.1 * RESOLUTION)


def test_a_room_is_one_closed_line_with_its_corners() -> None:
    cells = np.zeros((120, 160), dtype=np.int8)
    cells[20:100, 20:140] = 100
    cells[22:98, 22:138] = 0
    (line,) = wall_lines(OccupancyGrid(cells, RESOLUTION, ORIGIN))
    np.testing.assert_array_equal(line[0], line[-1])
    assert len(line) <= 9
    assert abs(length(line) - 2 * (78 + 118) * RESOLUTION) < 8 * RESOLUTION


def test_walls_that_meet_end_there_and_a_post_stays() -> None:
    grid = grid_with((slice(60, 61), slice(10, 110)), (slice(60, 110), slice(60, 61)), (slice(20, 21),) * 2)
    lines = wall_lines(grid)
    assert sorted(round(length(line) / RESOLUTION) for line in lines) == [1, 49, 49, 50]


def test_free_floor_has_no_lines() -> None:
    assert wall_lines(grid_with()) == []
