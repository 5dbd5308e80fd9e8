"""A bare hall, and things of any shape and orientation to put into it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid

Mask = NDArray[np.bool_]
MIDDLE = np.array([5.0, 4.0])
"""Metres in the grid's frame."""


def hall() -> OccupancyGrid:
    """10 x 8 m; the map frame is turned against the grid."""
    cells = np.full((80, 100), FREE, dtype=np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return OccupancyGrid(cells, 0.1, np.array([3.0, -2.0, 2.0]))


def furnished(grid: OccupancyGrid, mask: Mask) -> OccupancyGrid:
    """The grid with an obstacle on the cells of a mask (rows, columns)."""
    return replace(grid, cells=np.where(mask, np.int8(OCCUPIED), grid.cells))


def rectangle(
    grid: OccupancyGrid, center: NDArray[np.float64], length: float, width: float, yaw: float
) -> Mask:
    """(rows, columns) the cells within a rectangle about a point (2,), all in the grid's frame."""
    rows, columns = np.indices(grid.cells.shape)
    x, y = (columns + 0.5) * grid.resolution - center[0], (rows + 0.5) * grid.resolution - center[1]
    along, across = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
    inside: Mask = (np.abs(along) <= length / 2) & (np.abs(across) <= width / 2)
    return inside


def corner(grid: OccupancyGrid, yaw: float) -> Mask:
    """(rows, columns) the cells of an L with arms of 1.6 m, about the middle of the hall."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    other = MIDDLE + np.array([-0.5 * cos - 0.5 * sin, -0.5 * sin + 0.5 * cos])
    arm = rectangle(grid, MIDDLE, 1.6, 0.6, yaw)
    return arm | rectangle(grid, other, 0.6, 1.6, yaw)
