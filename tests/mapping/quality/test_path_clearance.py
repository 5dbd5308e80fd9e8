"""A path through what the map shows."""

import numpy as np
import pytest

from racecar.mapping.quality.path_clearance import share_through_obstacles
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid


def test_the_share_of_the_path_in_occupied_cells() -> None:
    cells = np.full((40, 100), FREE, dtype=np.int8)
    cells[:, 60:70] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, np.zeros(3))
    x = np.linspace(0.05, 9.95, 2000)
    path = np.column_stack([x, np.full_like(x, 2.0), np.zeros_like(x)])
    assert share_through_obstacles(path, grid) == pytest.approx(0.1, abs=0.01)
    standing = np.tile(path[:1], (500, 1))
    assert share_through_obstacles(np.concatenate([standing, path]), grid) == pytest.approx(0.1, abs=0.01)
