"""Occupancy grids drawn in axes of the map frame."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgba_array
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.thinning import thinned
from racecar.pipelines.files.pictures.colors import PLAN_COLOR

MOST_DRAWN_CELLS = 8_000_000
"""Largest grid drawn in full, because a picture has half as many dots and matplotlib takes 37 bytes per
cell."""
_UNKNOWN_COLOR = "#dfe3e8"
_OCCUPANCY = LinearSegmentedColormap.from_list("occupancy", ["#ffffff", "#1b1f24"])(np.linspace(0, 1, 101))
_COLORS = np.rint(255 * np.concatenate([to_rgba_array(_UNKNOWN_COLOR), _OCCUPANCY])).astype(np.uint8)
"""(102, 4) colour of an unknown cell, and then of each percentage."""
_PLAN = LinearSegmentedColormap.from_list("plan", [f"{PLAN_COLOR}00", PLAN_COLOR])(np.linspace(0, 1, 101))
_PLAN_COLORS = np.rint(255 * np.concatenate([np.zeros((1, 4)), _PLAN])).astype(np.uint8)
"""(102, 4) the same for a floor plan: what it leaves blank is transparent."""
_MOST_TICKS = 14
"""Intervals between ticks along the longer side: their numbers still fit beside one another."""


def draw_grid(
    axes: Axes,
    grid: OccupancyGrid,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    most_ticks: int = _MOST_TICKS,
) -> None:
    """Show a grid between two corners (2,) of the map frame: white is free, black occupied, grey unknown.

    A huge grid is drawn no finer than visible.
    """
    _draw_cells(axes, _cropped(grid, low, high), _COLORS)
    axes.set_facecolor(_UNKNOWN_COLOR)
    axes.grid(visible=False)
    show_area(axes, low, high, most_ticks)


def draw_plan(axes: Axes, plan: OccupancyGrid) -> None:
    """Draw the lines of a floor plan over the grid that is shown, and name them in the legend."""
    low, high = axes.viewLim.get_points()
    _draw_cells(axes, _cropped(plan, low, high), _PLAN_COLORS)
    axes.plot([], [], color=PLAN_COLOR, linewidth=2.0, label="floor plan")
    show_area(axes, low, high)


def _draw_cells(axes: Axes, grid: OccupancyGrid, colors: NDArray[np.uint8]) -> None:
    """Draw cells in ``colors`` (102, 4): of an unknown cell, and then of each percentage."""
    grid = thinned(grid, MOST_DRAWN_CELLS)
    rows, columns = grid.cells.shape
    x, y, yaw = grid.map_from_grid
    axes.imshow(
        colors[grid.cells.astype(np.int16) - UNKNOWN],  # matplotlib's own conversion takes 30 bytes per cell
        origin="lower",
        extent=(0, columns * grid.resolution, 0, rows * grid.resolution),
        interpolation_stage="rgba",
        transform=Affine2D().rotate(yaw).translate(x, y) + axes.transData,
    )


def show_area(
    axes: Axes, low: NDArray[np.float64], high: NDArray[np.float64], most_ticks: int = _MOST_TICKS
) -> None:
    """Show the area between two corners (2,) in metres, with ticks equally far apart on both axes, unless the
    shorter one would have none but one."""
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    step = round_length(float(np.max(high - low)) / most_ticks, up=True)
    for axis, length in zip((axes.xaxis, axes.yaxis), (high - low).tolist(), strict=True):
        axis.set_major_locator(MultipleLocator(min(step, round_length(length / 2, up=False))))


def round_length(metres: float, *, up: bool) -> float:
    """The next of 1, 2, 5, 10, 20 ... and their tenths, upwards or downwards."""
    power = 10.0 ** np.floor(np.log10(metres))
    steps = [factor * power for factor in (1.0, 2.0, 5.0, 10.0)]
    return float(
        min(step for step in steps if step >= metres) if up else max(step for step in steps if step <= metres)
    )


def _cropped(grid: OccupancyGrid, low: NDArray[np.float64], high: NDArray[np.float64]) -> OccupancyGrid:
    if grid.cells.size <= MOST_DRAWN_CELLS:
        return grid
    corners = grid.cell_of(np.array([low, high, [low[0], high[1]], [high[0], low[1]]]))
    first = np.clip(corners.min(axis=0) - 1, 0, np.array(grid.cells.shape) - 1)
    last = np.clip(corners.max(axis=0) + 2, first + 1, grid.cells.shape)
    moved = np.array([first[1] * grid.resolution, first[0] * grid.resolution, 0.0])
    cells = grid.cells[first[0] : last[0], first[1] : last[1]]
    return OccupancyGrid(cells, grid.resolution, compose(grid.map_from_grid, moved))
