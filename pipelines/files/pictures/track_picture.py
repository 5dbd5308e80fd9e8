"""track.png: the map with the centre line of the track and both its edges, dotted where they are no walls."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.centre_line import CentreLine
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.pictures.colors import LOOP_COLOR, PATH_COLOR, START_COLOR
from racecar.pipelines.files.pictures.figure_files import DOTS_PER_INCH, save_figure
from racecar.pipelines.files.pictures.heading import Heading
from racecar.pipelines.files.pictures.map_figure import MapFigure

_ARROW = 1.5
"""Length in metres of the arrow that shows the direction of the track. Chosen for its looks."""


def save_track_picture(path: Path, grid: OccupancyGrid, line: CentreLine, title: str) -> None:
    """Draw a track as PNG. Raises UserError when the file cannot be written."""
    facts = [f"{line.length:.1f} m long", f"{line.widths.min():.2f} to {line.widths.max():.2f} m wide"]
    if not np.all(line.is_walled):
        facts.append(f"along {np.mean(~line.is_walled):.0%} a side is no wall")
    picture = MapFigure(grid, line.points, Heading(title, facts=tuple(facts)))
    axes, ring = picture.axes, np.append(np.arange(len(line.points)), 0)
    sides = ((line.left, line.normals), (line.right, -line.normals))
    edges = [(line.points + bound.widths[:, None] * towards)[ring] for bound, towards in sides]
    walls = [
        np.where(bound.is_wall[ring, None], edge, np.nan)
        for (bound, _), edge in zip(sides, edges, strict=True)
    ]
    style: dict[str, Any] = {"color": LOOP_COLOR, "linewidth": 1.2, "zorder": 3}
    axes.plot(*_one_line(walls).T, label="edges", **style)
    if not np.all(line.is_walled):
        axes.plot(*_one_line(edges).T, linestyle=":", label="no wall", **style)
    axes.plot(*line.points[ring].T, color=PATH_COLOR, linewidth=1.4, label="centre line", zorder=4)
    start, ahead = line.points[0], line.points[1] - line.points[0]
    tip = start + _ARROW * ahead / np.hypot(*ahead)
    arrow = {"arrowstyle": "-|>", "color": START_COLOR, "linewidth": 2.0}
    axes.annotate("", xy=tuple(tip), xytext=tuple(start), arrowprops=arrow, zorder=5)
    axes.plot(*start, "o", color=START_COLOR, markeredgecolor="white", markersize=9, label="start", zorder=6)
    picture.add_legend()
    save_figure(path, picture.figure, DOTS_PER_INCH)


def _one_line(edges: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Lines (N, 2) as one, with gaps between them, so that the legend names them once."""
    return np.concatenate([np.append(edge, [[np.nan, np.nan]], axis=0) for edge in edges])
