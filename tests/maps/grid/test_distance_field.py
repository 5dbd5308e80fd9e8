"""The distance field against distances to every occupied cell."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@given(
    cells=arrays(
        np.int8, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.sampled_from([-1, 0, 100])
    ),
    resolution=st.floats(0.01, 1.0),
)
def test_distances_are_to_the_nearest_occupied_centre(cells: NDArray[np.int8], resolution: float) -> None:
    grid = OccupancyGrid(cells, resolution, np.array([3.0, -1.0, 2.0]))
    distances = distance_to_occupied(grid)
    everywhere = grid.center_of(np.argwhere(cells > -2))
    occupied = grid.center_of(np.argwhere(cells == 100))
    if len(occupied) == 0:
        assert np.all(distances >= resolution * np.hypot(*np.subtract(cells.shape, 1)))
        return
    expected = np.linalg.norm(everywhere[:, None] - occupied[None], axis=2).min(axis=1)
    np.testing.assert_allclose(distances.ravel(), expected, rtol=1e-5, atol=1e-6)


def test_sampling_is_exact_at_centres_and_linear_between() -> None:
    cells = np.zeros((4, 5), dtype=np.int8)
    cells[0] = 100
    grid = OccupancyGrid(cells, 0.5, np.array([1.0, 2.0, np.pi / 2]))
    field = distance_to_occupied(grid)
    centers = np.argwhere(cells >= 0)
    np.testing.assert_allclose(sample_field(field, grid, grid.center_of(centers)), field.ravel(), atol=1e-6)
    between = grid.center_of([[1, 2], [2, 2]]).mean(axis=0, keepdims=True)
    assert sample_field(field, grid, between)[0] == pytest.approx(0.75)


def test_beyond_the_grid_the_edge_stands() -> None:
    grid = OccupancyGrid(np.array([[100, 0, 0]], dtype=np.int8), 1.0, np.zeros(3))
    sampled = sample_field(distance_to_occupied(grid), grid, [[50.0, 0.5], [-50.0, 9.0]])
    np.testing.assert_allclose(sampled, [2.0, 0.0])
