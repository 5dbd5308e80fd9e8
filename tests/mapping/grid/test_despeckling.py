"""What is small, isolated and was seen only briefly is no wall."""

import numpy as np
import pytest

from racecar.mapping.grid.despeckling import despeckled
from racecar.maps.grid.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from tests.maps.grid.tiles import in_tiles

RESOLUTION = 0.05
KEYFRAMES = 30


def grid_of(*blobs: np.ndarray) -> OccupancyGrid:
    """Free floor, 10 m by 10 m, with the cells of some points occupied; turned and moved."""
    grid = OccupancyGrid(np.zeros((200, 200), dtype=np.int8), RESOLUTION, np.array([1.0, -2.0, 0.3]))
    for points in blobs:
        grid.cells[tuple(grid.cell_of(points).T)] = OCCUPIED
    return grid


def line(length: float, x: float, y: float) -> np.ndarray:
    """Points every 2 cm, along the grid's x axis, in the map."""
    along = np.arange(0.0, length, 0.02)
    grid = OccupancyGrid(np.zeros((200, 200), dtype=np.int8), RESOLUTION, np.array([1.0, -2.0, 0.3]))
    places = np.column_stack([np.full(len(along), y / RESOLUTION), (x + along) / RESOLUTION]).astype(int)
    return grid.center_of(places)


def cleaned_of(grid: OccupancyGrid, returns: list[np.ndarray]) -> OccupancyGrid:
    return despeckled(in_tiles(grid), returns, len(returns), 0.6).in_one_piece()


def seen(points: np.ndarray, times: int) -> list[np.ndarray]:
    """The returns of each keyframe; some times of all, the points are among them."""
    return [points if k < times else np.zeros((0, 2)) for k in range(KEYFRAMES)]


@pytest.mark.parametrize(
    ("length", "times", "stays"), [(0.4, 3, False), (0.4, 20, True), (2.0, 3, True), (0.04, 1, False)]
)
def test_only_what_is_small_and_hardly_seen_goes(length: float, times: int, stays: bool) -> None:
    blob = line(length, 5.0, 5.0)
    grid = grid_of(blob)
    cleaned = cleaned_of(grid, seen(blob, times))
    rows, columns = grid.cell_of(blob).T
    assert np.all(cleaned.cells[rows, columns] == (OCCUPIED if stays else UNKNOWN))
    assert np.all(cleaned.cells[grid.cells < OCCUPIED] == 0)


def test_what_stands_at_a_wall_belongs_to_it() -> None:
    wall, beside = line(4.0, 3.0, 5.0), line(0.2, 4.0, 5.1)
    grid = grid_of(wall, beside)
    cleaned = cleaned_of(grid, seen(np.concatenate([wall, beside]), 2))
    np.testing.assert_array_equal(cleaned.cells, grid.cells)


def test_looks_from_several_places_at_parts_of_it_count_together() -> None:
    blob = line(0.5, 5.0, 5.0)
    grid = grid_of(blob)
    parts = [blob[k % len(blob)][None] for k in range(KEYFRAMES)]
    np.testing.assert_array_equal(cleaned_of(grid, parts).cells, grid.cells)


def test_a_car_that_has_hardly_moved_keeps_all_it_sees() -> None:
    blob = line(0.2, 5.0, 5.0)
    grid = grid_of(blob)
    np.testing.assert_array_equal(cleaned_of(grid, [blob]).cells, grid.cells)


def test_an_empty_floor_stays_so() -> None:
    grid = grid_of()
    np.testing.assert_array_equal(cleaned_of(grid, seen(np.zeros((0, 2)), 0)).cells, grid.cells)
