"""Pictures of the sensor model: the table as a surface, and a slice of it with its four components."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.page import MAP_OF_NUMBERS, TRUTH, Page
from racecar.pipelines.files.pictures.colors import BLUE, GREEN, ORANGE, VERMILLION
from racecar.pipelines.runs.evaluation.course_filter import Z_MAX, mixture_parts, sensor_table
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_SLICE = 100
"""Expected range of the slice in pixels, by the map."""
_SMALL = 0.8
"""Share of the expected range below which a reading counts as much too short."""


def sensor_model(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """The course's table as it is; nothing is measured."""
    table = sensor_table()
    page = Page(
        "Sensor model: how likely a reading is",
        "The probability of a reading z where the map says d, both in pixels of the map (at 5 cm per "
        "pixel the table ends at 10 m). It is a mixture: a Gaussian about d (the wall was hit), a "
        "slope that falls from z = 0 to z = d (something stood in the way), all of the last row "
        "(nothing came back), and a constant (anything at all). Every column sums to 1. Probabilities "
        "of beams are multiplied; as beams are not independent, the product is raised to 1/2.2. This "
        "library compares no ranges, but asks how near the end points of a scan lie to walls.",
    )
    page.table(
        "The table at a few distances",
        (
            *("map says d (px)", "P(z = d)", "P(z within 16 px of d)"),
            *(f"P(z < {_SMALL:g} d)", "P(z at maximum)"),
        ),
        [_row(table[:, expected], expected) for expected in (20, _SLICE, 180, Z_MAX)],
    )
    page.figures |= {"slice_at_px": _SLICE, "slice": table[:, _SLICE]}
    _draw(page, table)
    return page


def _row(column: NDArray[np.float64], expected: int) -> tuple[str, ...]:
    readings = np.arange(Z_MAX + 1)
    return (
        f"{expected}",
        f"{column[expected]:.4f}",
        f"{column[np.abs(readings - expected) <= 16].sum():.2f}",
        f"{column[readings < _SMALL * expected].sum():.2f}",
        f"{column[-1]:.4f}",
    )


def _draw(page: Page, table: NDArray[np.float64]) -> None:
    surface = (
        "The sensor table as a surface; colours are logarithmic. The ridge is the wall where the map says it "
        "is, the edge at the back readings at the maximum."
    )
    with page.draw("sensor-model-surface", 72, surface) as figure:
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        assert isinstance(axes, Axes3D)
        axes.plot_surface(
            *np.meshgrid(np.arange(Z_MAX + 1), np.arange(Z_MAX + 1)),
            table,
            cmap=MAP_OF_NUMBERS,
            norm=LogNorm(table.min(), table.max()),
            rcount=67,
            ccount=67,
            linewidth=0,
            antialiased=False,
            rasterized=True,
        )
        axes.set(xlabel="map says d (px)", ylabel="measured z (px)", zlabel="probability")
        axes.view_init(elev=32, azim=-125)
        axes.set_box_aspect((1.0, 1.0, 0.65), zoom=0.88)
        figure.set_layout_engine("none")  # it would leave the labels of a 3D plot outside
        axes.set_position((0.1, 0.03, 0.82, 1.0))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MultipleLocator(50))
    column = f"A column of the table, where the map says {_SLICE} px, and the four parts that it is made of."
    with page.draw("sensor-model-slice", 66, column, legend_columns=3) as figure:
        axes = figure.subplots()
        colors = (BLUE, ORANGE, VERMILLION, GREEN)
        for (name, part), color in zip(mixture_parts(_SLICE).items(), colors, strict=True):
            axes.plot(part, color=color, linewidth=0.9, label=name)
        axes.plot(table[:, _SLICE], "--", color=TRUTH, linewidth=1.0, label="all together")
        axes.set(xlabel=f"measured z (px), where the map says {_SLICE} px", ylabel="probability")
        axes.set(yscale="log", ylim=(1e-5, 0.15))
