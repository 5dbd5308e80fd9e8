"""Ray casting over uneven ground, compiled."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.ray_casting import cast_one


@njit(cache=True, nogil=True)
def _height_at(heights: NDArray[np.float32], row: float, column: float) -> float:
    """Height in metres, interpolated between four cell centres; constant beyond the edge."""
    rows, columns = heights.shape
    row = min(max(row - 0.5, 0.0), rows - 1.0)
    column = min(max(column - 0.5, 0.0), columns - 1.0)
    r, c = min(int(row), max(rows - 2, 0)), min(int(column), max(columns - 2, 0))
    up, right = min(r + 1, rows - 1), min(c + 1, columns - 1)
    v, u = row - r, column - c
    low = (1.0 - u) * heights[r, c] + u * heights[r, right]
    high = (1.0 - u) * heights[up, c] + u * heights[up, right]
    height: float = (1.0 - v) * low + v * high
    return height


@njit(cache=True, nogil=True)
def _to_ground(
    heights: NDArray[np.float32],
    row: float,
    column: float,
    height: float,
    row_step: float,
    column_step: float,
    fall: float,
    highest: float,
    reach: float,
) -> float:
    """Horizontal cells until a ray, falling by ``fall`` metres per cell, is below the ground.

    Checked every cell and interpolated in between; inf if the ray stays above the ground within reach.
    """
    if height <= highest:
        distance = 0.0
    elif fall <= 0.0:
        return math.inf
    else:
        distance = (height - highest) / fall
    above = 0.0
    while distance <= reach:
        ground = _height_at(heights, row + distance * row_step, column + distance * column_step)
        now = height - fall * distance - ground
        if now <= 0.0:
            return distance if above <= 0.0 else distance + now / (above - now)
        if fall <= 0.0 and height - fall * distance > highest:
            return math.inf
        above = now
        distance += 1.0
    return math.inf


@njit(cache=True, nogil=True)
def cast_over_ground(
    cells: NDArray[np.int8],
    heights: NDArray[np.float32],
    starts: NDArray[np.float64],
    bearings: NDArray[np.float64],
    roughness: NDArray[np.float64],
    resolution: float,
    wheelbase: float,
    track: float,
    laser_ahead: float,
    laser_height: float,
    tilt: float,
    highest: float,
    reach: float,
    ranges: NDArray[np.float64],
) -> None:
    """Fill ranges (N,): bearing i from a car whose rear axle is at start i (N, 3), row, column, heading.

    ``wheelbase`` and ``track`` are in cells, all other lengths in metres. The car leans with the ground under
    its axles; ``roughness`` (N,) is the rise of the ground where each beam meets it.
    """
    for i in range(starts.shape[0]):
        row, column = starts[i, 0], starts[i, 1]
        cos, sin = math.cos(starts[i, 2]), math.sin(starts[i, 2])
        here = _height_at(heights, row, column)
        ahead = _height_at(heights, row + wheelbase * sin, column + wheelbase * cos)
        left = _height_at(heights, row + 0.5 * track * cos, column - 0.5 * track * sin)
        right = _height_at(heights, row - 0.5 * track * cos, column + 0.5 * track * sin)
        climb = (ahead - here) / (wheelbase * resolution)
        bank = (left - right) / (track * resolution)
        # The car's axes in the map: forward, left and up, orthogonalized.
        length = math.sqrt(1.0 + climb * climb)
        forward = (cos / length, sin / length, climb / length)
        up = (-climb * cos + bank * sin, -climb * sin - bank * cos, 1.0)
        length = math.sqrt(1.0 + climb * climb + bank * bank)
        up = (up[0] / length, up[1] / length, up[2] / length)
        aside = (
            up[1] * forward[2] - up[2] * forward[1],
            up[2] * forward[0] - up[0] * forward[2],
            up[0] * forward[1] - up[1] * forward[0],
        )
        column += (laser_ahead * forward[0] + laser_height * up[0]) / resolution
        row += (laser_ahead * forward[1] + laser_height * up[1]) / resolution
        height = here + laser_ahead * forward[2] + laser_height * up[2]
        a, b = math.cos(bearings[i]) * math.cos(tilt), math.sin(bearings[i])
        down = math.cos(bearings[i]) * math.sin(tilt)
        x = a * forward[0] + b * aside[0] - down * up[0]
        y = a * forward[1] + b * aside[1] - down * up[1]
        z = a * forward[2] + b * aside[2] - down * up[2]
        level = math.sqrt(x * x + y * y)
        row_step, column_step = y / level, x / level
        in_cells = reach * level / resolution
        to_wall = cast_one(cells, row, column, row_step, column_step, in_cells)
        to_ground = _to_ground(
            heights,
            row,
            column,
            height - roughness[i],
            row_step,
            column_step,
            -z / level * resolution,
            highest,
            min(in_cells, to_wall),
        )
        ranges[i] = min(to_wall, to_ground) * resolution / level
