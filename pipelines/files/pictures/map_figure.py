"""A map as a picture: heading, axes in metres, scale bar and legend, in a figure of the map's shape."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.pictures.colors import FRAME_COLOR, QUIET_COLOR
from racecar.pipelines.files.pictures.figure_files import NewFigure, figure_for_file
from racecar.pipelines.files.pictures.grid_drawing import draw_grid, round_length
from racecar.pipelines.files.pictures.heading import Heading
from racecar.pipelines.files.pictures.shown_area import shown_area

_LONG_SIDE = 11.0
"""Inches of the longer side of the map: letters are readable when the picture is as wide as a page."""
_LEFT, _RIGHT, _BELOW, _ABOVE = 0.75, 0.2, 0.55, 0.15
"""Inches around the map, for the axes."""
_BAR = 0.4
"""Inches beneath the axes for the scale bar, and for the legend beside it."""
_BAR_UP = _ABOVE + 0.08
"""Inches from the lower end of that to the bar: the middle of the legend's line."""
_NARROW = 6.0
"""Inches of a map's width up to which its legend is beneath the scale bar."""
_NARROW_LEGEND = 0.7
"""Additional height in inches for that: three rows of two entries."""
_NARROWEST = 3.4
"""Inches of width at least, for heading and legend."""
_THIN = 12.0
"""Ratio of length to width from which more is shown around a map, so its axis has room for numbers."""


class MapFigure:
    """A figure with one map."""

    def __init__(
        self,
        grid: OccupancyGrid,
        places: NDArray[np.float64],
        heading: Heading,
        new_figure: NewFigure = figure_for_file,
    ) -> None:
        """Draw the grid with room for ``places`` (N, 2) in metres of the map frame."""
        low, high = _not_too_thin(*shown_area(grid, places))
        width, height = (high - low) * _LONG_SIDE / np.max(high - low)
        self._is_narrow = bool(width < _NARROW)
        room = max(width, _NARROWEST)
        bottom = _BELOW + _BAR + (_NARROW_LEGEND if self._is_narrow else 0.0)
        top = bottom + height + 2 * _ABOVE + heading.height(room)
        self.figure = new_figure(figsize=(_LEFT + room + _RIGHT, top))
        inches = np.array([_LEFT, bottom, width, height])
        self.axes: Axes = self.figure.add_axes(tuple(inches / np.tile(self.figure.get_size_inches(), 2)))
        draw_grid(self.axes, grid, low, high)
        self.axes.set(xlabel="x (m)", ylabel="y (m)")
        self.axes.spines[:].set_color(FRAME_COLOR)
        self.axes.tick_params(color=FRAME_COLOR)
        _draw_scale_bar(self.figure, self.axes, low, high)
        heading.draw(self.figure, _LEFT, top - _ABOVE, room)

    def add_legend(self) -> None:
        """Name what was drawn in the axes, beneath them."""
        handles, labels = self.axes.get_legend_handles_labels()
        right = self.figure.get_figwidth() - _RIGHT
        beside: dict[str, Any] = {
            "loc": "lower right",
            "bbox_to_anchor": (right, _ABOVE),
            "ncols": len(labels),
        }
        beneath: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (_LEFT, _ABOVE), "ncols": 2}
        self.figure.legend(
            handles,
            labels,
            bbox_transform=self.figure.dpi_scale_trans,
            frameon=False,
            borderaxespad=0.0,
            borderpad=0.0,
            handlelength=1.5,
            columnspacing=1.4,
            **(beneath if self._is_narrow else beside),
        )


def _not_too_thin(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    lacks = np.maximum(np.max(high - low) / _THIN - (high - low), 0.0)
    return low - lacks / 2, high + lacks / 2


def _draw_scale_bar(figure: Figure, axes: Axes, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    """Draw a bar of a round length below the map on the left, where it cannot be mistaken for a wall."""
    width, height = high - low
    length = round_length(min(max(width, height) / 5, width / 2), up=False)
    down = ScaledTranslation(0.0, _BAR_UP - (_BELOW + _BAR), figure.dpi_scale_trans)
    beneath = axes.get_xaxis_transform() + down
    style: dict[str, Any] = {"color": QUIET_COLOR, "transform": beneath, "clip_on": False}
    axes.plot([low[0], low[0] + length], [0.0, 0.0], marker="|", markersize=8, linewidth=1.2, **style)
    axes.annotate(
        f"{length:g} m",
        (low[0] + length, 0.0),
        xycoords=beneath,
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=QUIET_COLOR,
        annotation_clip=False,
    )
