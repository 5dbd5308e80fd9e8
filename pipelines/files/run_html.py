"""What a notebook shows of a run: the verdict, sizes, and the path on the map."""

from html import escape

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.grid.html_picture import html_picture
from racecar.maps.grid.raster import Raster
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.pictures.colors import PATH_COLOR


def run_html(title: str, summary: str, grid: Raster, trajectory: Trajectory, warnings: int) -> str:
    """The title, the summary of the verdict, the sizes with their units, and the picture."""
    path: NDArray[np.float64] = trajectory.map_from_base[:, :2]
    width, height = grid.metres
    facts = [
        f"{width:.0f} × {height:.0f} m",
        f"cells of {grid.resolution:g} m",
        f"{len(path)} scans",
        *([f"{lengths_along(path)[-1]:.0f} m driven"] if len(path) else []),
        *([f"{warnings} warnings: see .warnings"] if warnings else []),
    ]
    picture = html_picture(grid, path if len(path) else None, PATH_COLOR)
    return f"<p><b>{escape(title)}</b>: {escape(summary)}<br>{escape(', '.join(facts))}</p>{picture}"
