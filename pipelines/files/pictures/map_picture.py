"""map.png: the map with the path and the closed loops."""

from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D, ScaledTranslation
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.thinning import thinned, thinning
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_files import write_atomically

PATH_COLOR, LOOP_COLOR, START_COLOR, END_COLOR, DOUBT_COLOR = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
)
"""Okabe and Ito's palette, which colour-blind people can distinguish too."""
_UNKNOWN_COLOR = "#dfe3e8"
_OCCUPANCY = LinearSegmentedColormap.from_list("occupancy", ["#ffffff", "#1b1f24"])(np.linspace(0, 1, 101))
_COLORS = np.rint(255 * np.concatenate([to_rgba_array(_UNKNOWN_COLOR), _OCCUPANCY])).astype(np.uint8)
"""(102, 4) colour of an unknown cell, and then of each percentage."""
_SCALE_BAR_COLOR = "#5b6570"
_SCALE_BAR_BELOW = 44.0
"""Points from the map's frame down to the bar, below the axis numbers and label."""
_LONG_SIDE_INCHES = 11.0
_FRAME_INCHES = np.array([0.8, 1.6])
"""Width and height around the map for axes, title, scale bar and a legend below."""
_LEGEND_INCHES = np.array([1.8, -0.3])
"""Additional width and height of a legend beside the map, compared with one below it."""
_LETTER_INCHES = 0.12
"""Width of a wide letter in the title."""
_CAUTION_LETTER_INCHES = 0.1
"""The same for a caution, whose letters are smaller."""
_CAUTION_COLOR = "#a33c00"
_TALL = 2.0
"""Ratio of height to width from which a map is narrower than a legend below it."""
_THIN = 12.0
"""Ratio of length to width from which more is shown around a map, so its axis has room for numbers."""
MAP_DOTS_PER_INCH = 200
_COMPRESSION = 3
"""zlib's level. Measured on a map of 4 million cells: 0.5 s less than the usual 6, in a file larger by a
sixth."""
MOST_DRAWN_CELLS = 8_000_000
"""Largest grid drawn in full, because a picture has half as many dots and matplotlib takes 37 bytes per
cell."""
_MARGIN = 1.0
"""Metres around the known cells."""


def figure_for_file(**options: Any) -> Figure:
    """A figure that no window shows."""
    figure = Figure(**options)
    FigureCanvasAgg(figure)
    return figure


def figure_to_show(**options: Any) -> Figure:
    """A figure that notebooks show automatically, and scripts with ``matplotlib.pyplot.show()``."""
    from matplotlib import pyplot  # may look for a display

    return pyplot.figure(**options)


NewFigure = Callable[..., Figure]
"""`figure_for_file` or `figure_to_show`."""


def map_picture(
    grid: OccupancyGrid,
    trajectory: Trajectory,
    map_from_keyframe: Pose,
    constraints: Sequence[Constraint],
    title: str,
    doubtful: Sequence[DoubtfulSegment] = (),
    *,
    starts: Sequence[int] = (),
    caution: str = "",
    new_figure: NewFigure = figure_for_file,
) -> Figure:
    """Draw the map with the path and its loops. Constraints and ``doubtful`` segments of the path are between
    keyframes at poses (K, 3). ``starts`` are the poses of the trajectory at which further drives begin; a
    ``caution`` is written over the map."""
    figure, axes = map_figure(grid, trajectory, title, caution, new_figure)
    keyframes = map_from_keyframe[:, :2]
    loops = [
        (keyframes[constraint.from_keyframe], keyframes[constraint.to_keyframe])
        for constraint in constraints
        if constraint.kind == "loop_closure"
    ]
    path = np.insert(trajectory.map_from_base[:, :2], starts, np.nan, axis=0)  # no line between drives
    axes.plot(*path.T, color=PATH_COLOR, linewidth=1.2, label="path", zorder=3)
    _draw_doubtful(axes, keyframes, doubtful)
    if loops:
        label = f"loop closures ({len(loops)})"
        axes.add_collection(LineCollection(loops, colors=LOOP_COLOR, linewidths=0.9, label=label))
    draw_ends(axes, trajectory, zorder=5, starts=starts)
    add_map_legend(figure, axes)
    return figure


def draw_ends(axes: Axes, trajectory: Trajectory, zorder: float, starts: Sequence[int] = ()) -> None:
    """Mark the start of a drive, and its end by a smaller mark, so both are visible at the same place;
    ``starts`` are the poses at which further drives begin."""
    places = trajectory.map_from_base[:, :2]
    first, last = places[[0, *starts]], places[[*(start - 1 for start in starts), -1]]
    style: dict[str, Any] = {"linestyle": "none", "markeredgecolor": "white", "zorder": zorder}
    axes.plot(*first.T, marker="o", markersize=12, color=START_COLOR, label="start", **style)
    axes.plot(*last.T, marker="s", markersize=7, color=END_COLOR, label="end", **style)


def _draw_doubtful(axes: Axes, keyframes: NDArray[np.float64], segments: Sequence[DoubtfulSegment]) -> None:
    """Mark the doubtful segments of a path with keyframes at (K, 2)."""
    runs = [run for each in segments for run in (each.keyframes, each.contradicted_by) if run is not None]
    lines = [keyframes[first : last + 1] for first, last in runs]
    if lines:
        style: dict[str, Any] = {"colors": DOUBT_COLOR, "linewidths": 5.0, "capstyle": "round", "zorder": 2.5}
        axes.add_collection(LineCollection(lines, label="doubtful", **style))


def map_figure(
    grid: OccupancyGrid,
    trajectory: Trajectory,
    title: str,
    caution: str = "",
    new_figure: NewFigure = figure_for_file,
) -> tuple[Figure, Axes]:
    """A figure with the grid in axes in metres of the map frame, with room for the trajectory."""
    low, high = _extent(grid, trajectory)
    inches = (high - low) * _LONG_SIDE_INCHES / np.max(high - low)
    beside = _LEGEND_INCHES if _is_tall(low, high) else np.zeros(2)
    figure = new_figure(figsize=inches + _FRAME_INCHES + beside, layout="constrained")
    axes = figure.add_subplot()
    draw_grid(axes, grid, (low, high))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    if _is_tall(low, high):
        _draw_title_over(figure, title, caution)
    else:
        draw_title(axes, title)
        _draw_caution(figure, caution)
    axes.spines[:].set_color("#9aa3ad")
    axes.tick_params(color="#9aa3ad")
    _draw_scale_bar(figure, axes, low, high)
    return figure, axes


def draw_grid(
    axes: Axes,
    grid: OccupancyGrid,
    window: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> None:
    """Draw an occupancy grid in the map frame: white is free, black occupied, grey unknown.

    A huge grid is drawn no finer than visible, and only in the ``window`` from one corner (2,) to the other
    (2,), if given.
    """
    grid = thinned(grid if window is None else _cropped(grid, *window), MOST_DRAWN_CELLS)
    rows, columns = grid.cells.shape
    x, y, yaw = grid.map_from_grid
    axes.imshow(
        _COLORS[grid.cells.astype(np.int16) - UNKNOWN],  # matplotlib's own conversion takes 30 bytes per cell
        origin="lower",
        extent=(0, columns * grid.resolution, 0, rows * grid.resolution),
        interpolation_stage="rgba",
        transform=Affine2D().rotate(yaw).translate(x, y) + axes.transData,
    )
    axes.set_facecolor(_UNKNOWN_COLOR)


def known_cells(grid: OccupancyGrid) -> NDArray[np.int64]:
    """(N, 2) row and column of the known cells; for a huge grid, an even sample."""
    step = thinning(grid, MOST_DRAWN_CELLS)
    return step * np.argwhere(grid.cells[::step, ::step] != UNKNOWN)


def _cropped(grid: OccupancyGrid, low: NDArray[np.float64], high: NDArray[np.float64]) -> OccupancyGrid:
    if grid.cells.size <= MOST_DRAWN_CELLS:
        return grid
    corners = grid.cell_of(np.array([low, high, [low[0], high[1]], [high[0], low[1]]]))
    first = np.clip(corners.min(axis=0) - 1, 0, np.array(grid.cells.shape) - 1)
    last = np.clip(corners.max(axis=0) + 2, first + 1, grid.cells.shape)
    moved = np.array([first[1] * grid.resolution, first[0] * grid.resolution, 0.0])
    cells = grid.cells[first[0] : last[0], first[1] : last[1]]
    return OccupancyGrid(cells, grid.resolution, compose(grid.map_from_grid, moved))


def draw_title(axes: Axes, title: str) -> None:
    """Add a title, which may be any file name, above the axes."""
    axes.set_title(_printable(title), loc="left", parse_math=False)


def _draw_title_over(figure: Figure, title: str, caution: str) -> None:
    """Add a title above a narrow figure, broken into lines; above its axes it would squeeze them."""
    width = int(figure.get_figwidth() / _LETTER_INCHES)
    lines = "\n".join(fill(_printable(each), width) for each in (title, caution) if each)
    figure.suptitle(lines, x=0.02, ha="left", fontsize="large", parse_math=False)


def _draw_caution(figure: Figure, caution: str) -> None:
    """Write a caution above everything else, where it is read first."""
    if caution:
        lines = fill(_printable(caution), int(figure.get_figwidth() / _CAUTION_LETTER_INCHES))
        figure.suptitle(
            lines, x=0.02, ha="left", fontsize="medium", weight="bold", color=_CAUTION_COLOR, parse_math=False
        )


def _printable(title: str) -> str:
    return title.encode(errors="replace").decode()


def add_legend(figure: Figure, axes: Axes) -> None:
    """Add the legend below the axes, where it covers nothing."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)


def add_map_legend(figure: Figure, axes: Axes) -> None:
    """Add the legend of `map_figure` below the map, or beside a map narrower than the legend."""
    if not _is_tall(*axes.viewLim.get_points()):
        add_legend(figure, axes)
        return
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right center", frameon=False)


def _is_tall(low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    width, height = high - low
    return bool(height > _TALL * width)


def save_figure(path: Path, figure: Figure, dots_per_inch: int, author: str = "racecar") -> None:
    """Write a figure as PNG, complete or not at all, with the command that made it as its author.

    Raises UserError when the file cannot be written.
    """
    _lay_out(figure, dots_per_inch)
    with write_atomically(path) as partial:
        figure.savefig(
            partial,
            format="png",
            dpi=dots_per_inch,
            metadata={"Software": author},
            pil_kwargs={"compress_level": _COMPRESSION},
        )


def _lay_out(figure: Figure, dots_per_inch: int) -> None:
    """Compute the layout once; matplotlib would draw a large grid for that, and again for the output."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(dots_per_inch)
        for _ in range(2):  # as matplotlib does; tick sizes are known in the second pass
            engine.execute(figure)
        figure.set_layout_engine(None)


def _extent(grid: OccupancyGrid, trajectory: Trajectory) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    known = known_cells(grid)
    corners = known[[*known.argmin(axis=0), *known.argmax(axis=0)]] if len(known) else known
    places = np.vstack([grid.center_of(corners), trajectory.map_from_base[:, :2]])
    low, high = places.min(axis=0) - _MARGIN, places.max(axis=0) + _MARGIN
    lacks = np.maximum(np.max(high - low) / _THIN - (high - low), 0.0)
    return low - lacks / 2, high + lacks / 2


def _draw_scale_bar(figure: Figure, axes: Axes, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    """Draw a bar of a round length below the map on the left, where it cannot be mistaken for a wall."""
    width, height = high - low
    most = min(max(width, height) / 5, width / 2)
    power = 10.0 ** np.floor(np.log10(most))
    length = max(step * power for step in (1, 2, 5) if step * power <= most)
    down = ScaledTranslation(0.0, -_SCALE_BAR_BELOW / 72, figure.dpi_scale_trans)
    beneath = axes.get_xaxis_transform() + down
    style: dict[str, Any] = {"color": _SCALE_BAR_COLOR, "transform": beneath, "clip_on": False}
    axes.plot([low[0], low[0] + length], [0.0, 0.0], marker="|", markersize=8, linewidth=1.2, **style)
    axes.annotate(
        f"{length:g} m",
        (low[0] + length, 0.0),
        xycoords=beneath,
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=_SCALE_BAR_COLOR,
        annotation_clip=False,
    )
