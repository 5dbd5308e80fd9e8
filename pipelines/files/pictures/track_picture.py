"""track.png: the map with the centre line of the track and both its edges."""

from pathlib import Path

import numpy as np

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
    widths = line.left + line.right
    facts = (f"{line.length:.1f} m long", f"{widths.min():.2f} to {widths.max():.2f} m wide")
    picture = MapFigure(grid, line.points, Heading(title, facts=facts))
    axes, ring = picture.axes, np.append(np.arange(len(line.points)), 0)
    for widths, label in ((line.left, "edges"), (-line.right, None)):
        edge = (line.points + widths[:, None] * line.normals)[ring]
        axes.plot(*edge.T, color=LOOP_COLOR, linewidth=1.0, label=label, zorder=3)
    axes.plot(*line.points[ring].T, color=PATH_COLOR, linewidth=1.4, label="centre line", zorder=4)
    start, ahead = line.points[0], line.points[1] - line.points[0]
    tip = start + _ARROW * ahead / np.hypot(*ahead)
    arrow = {"arrowstyle": "-|>", "color": START_COLOR, "linewidth": 2.0}
    axes.annotate("", xy=tuple(tip), xytext=tuple(start), arrowprops=arrow, zorder=5)
    axes.plot(*start, "o", color=START_COLOR, markeredgecolor="white", markersize=9, label="start", zorder=6)
    picture.add_legend()
    save_figure(path, picture.figure, DOTS_PER_INCH)
