"""A huge grid is shown with fewer cells, and no wall is lost."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.thinning import thinned, thinning
from tests.maps.grid.tiles import in_tiles


@given(st.integers(1, 1100), st.integers(1, 70), st.integers(1, 5000), st.integers(0, 2**32))
def test_a_block_is_its_most_occupied_cell(rows: int, columns: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((rows, columns)) < 0.7, UNKNOWN, rng.integers(0, 101, (rows, columns)))
    grid = OccupancyGrid(cells.astype(np.int8), 0.05, np.array([1.0, 2.0, 0.3]))
    step = thinning(grid, most)
    for small in (thinned(grid, most), thinned(in_tiles(grid), most)):
        assert small.resolution == step * 0.05
        padded = np.pad(cells, ((0, -rows % step), (0, -columns % step)), constant_values=UNKNOWN)
        blocks = padded.reshape(len(padded) // step, step, -1, step).max(axis=(1, 3))
        np.testing.assert_array_equal(small.cells, blocks)
