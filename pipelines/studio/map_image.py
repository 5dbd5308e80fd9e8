"""An occupancy grid as a picture for the page."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED_THRESHOLD, UNKNOWN, OccupancyGrid
from racecar.maps.grid.raster import Raster
from racecar.maps.grid.thinning import thinned
from racecar.pipelines.files.pictures.shown_area import known_cells
from racecar.pipelines.studio.palette import Backdrop, Color

MOST_CELLS = 16_000_000
"""Maximum cells for drawing single cells instead of blocks: graphics cards support textures of at least 4096
pixels a side, and a browser stores four bytes per pixel."""
_CRISP_CELLS = 4_000_000
"""Maximum cells drawn as four pixels each, since browsers interpolate pixels and would blur cells."""
_WALL = round(100 * OCCUPIED_THRESHOLD)
"""Percent from which a cell is occupied."""

_TINT = 0.4
"""Opacity of a tint, so that walls remain visible."""


class MapImage(NamedTuple):
    """Pixels and their position."""

    pixels: NDArray[np.uint8]
    """(rows, columns, 3), row 0 at the bottom as in a grid."""
    size: tuple[float, float]
    """Metres, width and height."""
    map_from_middle: Pose
    """(3,) pose of the picture's centre."""


def paint(
    grid: Raster,
    ground: Backdrop,
    tints: Sequence[tuple[Raster, Color]] = (),
    *,
    pixel: float = 0.0,
    least_wall: float = 0.0,
) -> MapImage:
    """Paint free, occupied and unknown cells in a background's colours; a huge grid is reduced.

    ``tints`` are masks on the same cells, each with the colour to mix in where it is above 0. ``pixel`` is
    the size in metres of a pixel of the screen: walls are at least ``least_wall`` pixels wide.
    """
    grid = thinned(grid, MOST_CELLS)
    cells = _thickened(grid.cells, round(least_wall * pixel / grid.resolution) - 1)
    pixels = _colors(ground)[cells.astype(np.int64) - UNKNOWN]
    for mask, color in tints:
        is_tinted = thinned(mask, MOST_CELLS).cells > 0
        pixels[is_tinted] = (1.0 - _TINT) * pixels[is_tinted] + _TINT * np.array(color)
    rows, columns = grid.cells.shape
    size = columns * grid.resolution, rows * grid.resolution
    middle = transform_points(grid.map_from_grid, np.array([[size[0] / 2, size[1] / 2]]))[0]
    if grid.cells.size <= _CRISP_CELLS and pixel < grid.resolution:
        pixels = pixels.repeat(2, axis=0).repeat(2, axis=1)
    return MapImage(pixels, size, np.array([*middle, grid.map_from_grid[2]]))


def _thickened(cells: NDArray[np.int8], width: int) -> NDArray[np.int8]:
    """The cells with their walls ``width - 1`` cells wider."""
    if width < 2:
        return cells
    walls = np.where(cells >= _WALL, cells, np.int8(UNKNOWN))
    thick: NDArray[np.int8] = np.maximum(cells, maximum_filter(walls, width))
    return thick


def known_extent(grid: OccupancyGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """The lower left and the upper right corner, (2,) each, of the known cells; None if there are none."""
    known = known_cells(grid)
    if not len(known):
        return None
    corners = grid.center_of(known[[*known.argmin(axis=0), *known.argmax(axis=0)]])
    return corners.min(axis=0), corners.max(axis=0)


def _colors(ground: Backdrop) -> NDArray[np.uint8]:
    """(102, 3): unknown, then from 0 to 100 percent occupied."""
    share = np.linspace(0.0, 1.0, 101)[:, None]
    known = (1.0 - share) * np.array(ground.free) + share * np.array(ground.occupied)
    return np.vstack([ground.unknown, known]).astype(np.uint8)
