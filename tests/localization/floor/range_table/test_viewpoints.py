import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.viewpoints import choose_viewpoints
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid


def free_space(kinds: np.ndarray) -> FreeSpace:
    """From kinds (rows, columns): 0 where no car can be, 1 open, 2 an obstacle that can be moved."""
    grid = OccupancyGrid(np.full(kinds.shape, FREE, dtype=np.int8), 0.1, IDENTITY)
    return FreeSpace(grid, kinds == 1, kinds == 2)


def test_four_open_cells_are_seen_from_their_middle() -> None:
    index, viewpoints = choose_viewpoints(free_space(np.ones((2, 4), dtype=np.int64)))
    np.testing.assert_array_equal(index, [[0, 0, 1, 1], [0, 0, 1, 1]])
    np.testing.assert_array_equal(viewpoints, [[1.0, 1.0], [1.0, 3.0]])


def test_fewer_are_seen_from_the_middle_of_the_first() -> None:
    index, viewpoints = choose_viewpoints(free_space(np.array([[0, 1], [1, 1]])))
    np.testing.assert_array_equal(index, [[-1, 0], [0, 0]])
    np.testing.assert_array_equal(viewpoints, [[0.5, 1.5]])


def test_cells_on_both_sides_of_a_slanting_wall_have_views_of_their_own() -> None:
    index, viewpoints = choose_viewpoints(free_space(np.array([[1, 0], [0, 1]])))
    assert index[0, 0] != index[1, 1]
    np.testing.assert_array_equal(viewpoints[index[1, 1]], [1.5, 1.5])


@settings(deadline=None)
@given(st.integers(0, 10**9))
def test_each_cell_is_near_a_viewpoint_of_its_kind(seed: int) -> None:
    kinds = np.random.default_rng(seed).choice(3, (7, 9), p=[0.2, 0.6, 0.2])
    index, viewpoints = choose_viewpoints(free_space(kinds))
    np.testing.assert_array_equal(index >= 0, kinds > 0)
    assert set(index[index >= 0]) == set(range(len(viewpoints)))
    row, column = np.nonzero(kinds)
    offsets = viewpoints[index[row, column]] - np.column_stack([row, column]) - 0.5
    assert np.abs(offsets).max(initial=0.0) <= 1.0
    seen_from = np.ceil(viewpoints[index[row, column]]).astype(np.int64) - 1
    np.testing.assert_array_equal(kinds[tuple(seen_from.T)], kinds[row, column])
