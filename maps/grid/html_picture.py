"""A small picture of a grid for notebooks, without a library for figures."""

from base64 import b64encode
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from racecar.maps.grid.raster import Raster
from racecar.maps.grid.thinning import thinned
from racecar.maps.image_files import BLACK, GREY, WHITE

_MOST_CELLS = 250_000
"""A picture of some kilobytes, as many are kept in one notebook."""
_WIDEST = 640
"""Pixels that a notebook's column has."""


def html_picture(grid: Raster, path: NDArray[np.float64] | None = None, color: str = "#0072B2") -> str:
    """An ``<svg>`` with the grid, row 0 at the bottom, and a path (N, 2) in metres of the map over it."""
    shown = thinned(grid, _MOST_CELLS)
    rows, columns = shown.shape
    pixels = np.select([shown.is_occupied, shown.is_free], [BLACK, WHITE], GREY).astype(np.uint8)
    file = BytesIO()
    Image.fromarray(pixels[::-1]).save(file, "PNG", optimize=True)
    image = b64encode(file.getvalue()).decode()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDEST}"'
        f' style="max-width: 100%; max-height: 480px" viewBox="0 0 {columns} {rows}">'
        f'<image width="{columns}" height="{rows}" style="image-rendering: pixelated"'
        f' href="data:image/png;base64,{image}"/>'
        f"{'' if path is None else _line(shown.raster_of(path), rows, color)}</svg>"
    )


def _line(raster: NDArray[np.float64], rows: int, color: str) -> str:
    corners = " ".join(f"{column + 0.5:.1f},{rows - row - 0.5:.1f}" for row, column in raster)
    style = f'fill="none" stroke="{color}" stroke-width="2" vector-effect="non-scaling-stroke"'
    return f'<polyline points="{corners}" {style}/>'
