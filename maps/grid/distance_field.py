"""How far each place is from the nearest obstacle."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from racecar.maps.geometry.se2 import inverse, transform_points
from racecar.maps.grid.distance_field_kernels import fill_distances
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid


def distance_to_occupied(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(rows, columns) metres from each cell's centre to that of the nearest occupied cell.

    Where nothing is occupied the grid's diagonal stands for "far".
    """
    occupied = grid.cells >= OCCUPIED_FROM
    if not occupied.any():
        return np.full(occupied.shape, np.hypot(*occupied.shape) * grid.resolution, dtype=np.float32)
    distances = np.empty(occupied.shape, dtype=np.float32)
    fill_distances(occupied, grid.resolution, distances)
    return distances


def sample_field(
    field: NDArray[np.float32], grid: OccupancyGrid, points_in_map: ArrayLike
) -> NDArray[np.float32]:
    """(N,) the field (rows, columns) of a grid at points (N, 2), bilinear between the centres of cells.

    Beyond the grid the nearest edge cell's value stands.
    """
    points_in_grid = transform_points(inverse(grid.map_from_grid), points_in_map)
    rows_and_columns = points_in_grid[:, ::-1].T / grid.resolution - 0.5
    sampled: NDArray[np.float32] = map_coordinates(field, rows_and_columns, order=1, mode="nearest")
    return sampled
