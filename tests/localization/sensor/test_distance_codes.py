"""The raster of distances, which is finer or coarser than the cells of the map."""

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.likelihood_field import (
    CODES,
    FINEST,
    STEP,
    LikelihoodField,
    distance_codes,
)
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid

CELLS = (0.02, 0.025, 0.05, 0.1)
PIXELS = (0.01, 0.025, 0.05, 0.1, 0.25)


def wall_on_the_left(resolution: float) -> OccupancyGrid:
    """4 x 3 m, its first half metre occupied; the map frame is turned against the grid."""
    cells = np.full((round(3.0 / resolution), round(4.0 / resolution)), FREE, dtype=np.int8)
    cells[:, : round(0.5 / resolution)] = OCCUPIED
    return OccupancyGrid(cells, resolution, np.array([3.0, -2.0, 2.0]))


def codes_of(grid: OccupancyGrid, pixel: float) -> NDArray[np.uint8]:
    return distance_codes(Walls(grid), find_free_space(grid), pixel)


def from_the_wall(columns: int, pixel: float, resolution: float) -> NDArray[np.float64]:
    """(columns,) metres from the middles of pixels to the surface that the nearest cells of the wall have."""
    last_wall = 0.5 - resolution / 2.0
    return np.maximum((np.arange(columns) + 0.5) * pixel - last_wall, 0.0)


@pytest.mark.parametrize("resolution", CELLS)
@pytest.mark.parametrize("pixel", PIXELS)
def test_before_a_wall_codes_are_distances_whatever_the_cells(pixel: float, resolution: float) -> None:
    codes = codes_of(wall_on_the_left(resolution), pixel)
    rows, columns = codes.shape[0] - 2, codes.shape[1] - 2
    assert (rows, columns) == (round(3.0 / pixel), round(4.0 / pixel))
    expected = from_the_wall(columns, pixel, resolution)
    is_coded = (expected > 0.0) & (expected < (CODES - 2) * STEP)
    is_coded[-round(0.1 / pixel) - 1 :] = False  # beyond the middle of the last cell is nothing to go by
    coded = STEP * codes[1:-1, 1:-1]
    assert np.abs(coded[:, is_coded] - expected[is_coded]).max() < 0.51 * STEP + 1e-6
    assert np.all(coded[:, expected == 0.0] < 0.51 * STEP)


def test_beyond_the_map_is_no_wall() -> None:
    codes = codes_of(wall_on_the_left(0.05), 0.025)
    for edge in (codes[0], codes[-1], codes[:, 0], codes[:, -1]):
        assert np.all(edge >= CODES - 2)


def test_beyond_the_map_nothing_is_known_where_the_floor_goes_on() -> None:
    codes = codes_of(wall_on_the_left(0.05), 0.05)
    assert np.all(codes[1:-1, 0] == CODES - 2)
    assert np.all(codes[1:-1, -1] == CODES - 1)
    for edge in (codes[0], codes[-1]):
        assert np.all(edge[1:11] == CODES - 2)
        assert np.all(edge[12:-1] == CODES - 1)


@pytest.mark.parametrize("resolution", CELLS)
def test_the_field_is_never_coarser_than_its_finest_pixels_and_they_fill_cells(resolution: float) -> None:
    grid = wall_on_the_left(resolution)
    pixel = LikelihoodField(Walls(grid), find_free_space(grid)).pixel
    assert pixel <= FINEST + 1e-9
    assert resolution / pixel == pytest.approx(round(resolution / pixel))
