"""map.png: the map with the path and the closed loops."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.pictures.colors import (
    DOUBT_COLOR,
    END_COLOR,
    LOOP_COLOR,
    PATH_COLOR,
    START_COLOR,
)
from racecar.pipelines.files.pictures.figure_files import NewFigure, figure_for_file
from racecar.pipelines.files.pictures.grid_drawing import draw_plan
from racecar.pipelines.files.pictures.heading import Heading
from racecar.pipelines.files.pictures.map_figure import MapFigure

Line = NDArray[np.float64]
"""(N, 2) metres in the map frame."""


def map_picture(
    grid: OccupancyGrid,
    drives: Sequence[Line],
    heading: Heading,
    *,
    loops: Sequence[Line] = (),
    doubtful: Sequence[Line] = (),
    floor_plan: OccupancyGrid | None = None,
    new_figure: NewFigure = figure_for_file,
) -> Figure:
    """Draw the map with a floor plan, the path of each drive, the loops closed and the doubtful parts of the
    paths."""
    picture = MapFigure(grid, np.concatenate(drives), heading, new_figure)
    axes = picture.axes
    if floor_plan is not None:
        draw_plan(axes, floor_plan)
    for number, path in enumerate(drives):
        label = None if number else "path"
        axes.plot(*path.T, color=PATH_COLOR, linewidth=1.2, label=label, zorder=3)
    if doubtful:
        style: dict[str, Any] = {"colors": DOUBT_COLOR, "linewidths": 5.0, "capstyle": "round", "zorder": 2.5}
        axes.add_collection(LineCollection(doubtful, label="doubtful", **style), autolim=False)
    if loops:
        style = {"colors": LOOP_COLOR, "linewidths": 0.9, "label": f"loop closures ({len(loops)})"}
        axes.add_collection(LineCollection(loops, **style), autolim=False)
    draw_ends(axes, drives, zorder=5)
    picture.add_legend()
    return picture.figure


def draw_ends(axes: Axes, drives: Sequence[Line], zorder: float) -> None:
    """Mark the start of each drive, and its end by a smaller mark, so both are visible at the same place."""
    style: dict[str, Any] = {"linestyle": "none", "markeredgecolor": "white", "zorder": zorder}
    first, last = (np.array([path[index] for path in drives]) for index in (0, -1))
    axes.plot(*first.T, marker="o", markersize=12, color=START_COLOR, label="start", **style)
    axes.plot(*last.T, marker="s", markersize=7, color=END_COLOR, label="end", **style)
