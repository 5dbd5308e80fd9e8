"""The raster of distances, which is finer or coarser than the cells of the map."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.localization.floor.free_space import find_free_space
from racecar.localization.floor.walls import find_walls
from racecar.localization.sensor.distance_codes import CODES, STEP, DistanceCodes
from racecar.localization.sensor.likelihood_field import FINEST, LikelihoodField
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid

CELLS = (0.02, 0.025, 0.05, 0.1)
PIXELS = (0.01, 0.025, 0.05, 0.1, 0.25)


def wall_on_the_left(resolution: float) -> OccupancyGrid:
    """4 x 3 m, its first half metre occupied; the map frame is turned against the grid."""
    cells = np.full((round(3.0 / resolution), round(4.0 / resolution)), FREE, dtype=np.int8)
    cells[:, : round(0.5 / resolution)] = OCCUPIED
    return OccupancyGrid(cells, resolution, np.array([3.0, -2.0, 2.0]))


def from_the_wall(columns: int, pixel: float, resolution: float) -> NDArray[np.float64]:
    """(columns,) metres from the middles of pixels to the surface that the nearest cells of the wall have."""
    last_wall = 0.5 - resolution / 2.0
    return np.maximum((np.arange(columns) + 0.5) * pixel - last_wall, 0.0)


@pytest.mark.parametrize("resolution", CELLS)
@pytest.mark.parametrize("pixel", PIXELS)
def test_before_a_wall_codes_are_distances_whatever_the_cells(pixel: float, resolution: float) -> None:
    codes = DistanceCodes(find_walls(wall_on_the_left(resolution)), pixel).codes
    rows, columns = codes.shape[0] - 2, codes.shape[1] - 2
    assert (rows, columns) == (round(3.0 / pixel), round(4.0 / pixel))
    expected = from_the_wall(columns, pixel, resolution)
    is_coded = (expected > 0.0) & (expected < (CODES - 1) * STEP)
    is_coded[-round(0.1 / pixel) - 1 :] = False  # beyond the middle of the last cell is nothing to go by
    coded = STEP * codes[1:-1, 1:-1]
    assert np.abs(coded[:, is_coded] - expected[is_coded]).max() < 0.51 * STEP + 1e-6
    assert np.all(coded[:, expected == 0.0] < 0.51 * STEP)


def test_beyond_the_map_is_no_wall() -> None:
    codes = DistanceCodes(find_walls(wall_on_the_left(0.05)), 0.025).codes
    for edge in (codes[0], codes[-1], codes[:, 0], codes[:, -1]):
        assert np.all(edge == CODES - 1)


@pytest.mark.parametrize("resolution", CELLS)
def test_the_field_is_never_coarser_than_its_finest_pixels_and_they_fill_cells(resolution: float) -> None:
    grid = wall_on_the_left(resolution)
    pixel = LikelihoodField(find_walls(grid), find_free_space(grid)).distances.pixel
    assert pixel <= FINEST + 1e-9
    assert resolution / pixel == pytest.approx(round(resolution / pixel))


@settings(max_examples=30)
@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_sums_about_cells_are_those_of_the_pixels_there_however_far(x: float, y: float) -> None:
    distances = DistanceCodes(find_walls(wall_on_the_left(0.05)), 0.1)
    by_code = np.arange(CODES, dtype=np.float32)
    here, beside = np.array([20, 40]), np.array([[[0.5, 0.0], [0.0, 0.5]]])
    row, column = ((here + 0.5) * 0.5 + 1.0).astype(int)
    expected = int(distances.codes[row, column + 5]) + int(distances.codes[row + 5, column])
    assert distances.sums_about(here[None], beside, by_code).tolist() == [[expected]]
    far = distances.sums_about(here[None], np.array([[[x, y]]]), by_code)
    assert far.shape == (1, 1)
    if max(abs(x), abs(y)) > 10.0:
        assert far[0, 0] == CODES - 1
