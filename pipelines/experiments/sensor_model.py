"""The sensor model in pictures: the table as a surface, and a slice of it with its four parts."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from racecar.pipelines.evaluation.course_filter import Z_MAX, mixture_parts, sensor_table
from racecar.pipelines.experiments.figure_style import (
    BLUE,
    GREEN,
    MAP_OF_NUMBERS,
    ORANGE,
    TRUTH,
    VERMILLION,
    Picture,
    drawing,
    finish,
    legend_below,
)
from racecar.pipelines.experiments.result import ExperimentSettings, FigureTable
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_SLICE = 100
"""Pixels that the map says in the slice."""
_SMALL = 0.8
"""Share of what is measured that counts as much too short."""


@dataclass(frozen=True, eq=False)
class SensorModelResult:
    """The course's table."""

    table: NDArray[np.float64]
    """(201, 201) probability of a reading (row) where the map says a distance (column), pixels."""
    title: str = "Sensor model: how likely a reading is"

    def text(self) -> list[str]:
        return [
            "The probability of a reading z where the map says d, both in pixels of the map (at 5 cm per "
            "pixel the table ends at 10 m). It is a mixture: a Gaussian about d (the wall was hit), a "
            "slope that falls from z = 0 to z = d (something stood in the way), all of the last row "
            "(nothing came back), and a constant (anything at all). Every column sums to 1. Probabilities "
            "of beams are multiplied; as beams are not independent, the product is raised to 1/2.2. This "
            "library compares no ranges, but asks how near the end points of a scan lie to walls."
        ]

    def tables(self) -> list[FigureTable]:
        rows = []
        for expected in (20, _SLICE, 180, Z_MAX):
            column = self.table[:, expected]
            readings = np.arange(Z_MAX + 1)
            near = np.abs(readings - expected) <= 16
            rows.append(
                (
                    f"{expected}",
                    f"{column[expected]:.4f}",
                    f"{column[near].sum():.2f}",
                    f"{column[readings < _SMALL * expected].sum():.2f}",
                    f"{column[-1]:.4f}",
                )
            )
        columns = (
            *("map says d (px)", "P(z = d)", "P(z within 16 px of d)"),
            *(f"P(z < {_SMALL:g} d)", "P(z at maximum)"),
        )
        return [FigureTable("The table at a few distances", columns, rows)]

    def figures(self) -> dict[str, Any]:
        return {"slice_at_px": _SLICE, "slice": self.table[:, _SLICE]}

    def pictures(self) -> list[Picture]:
        return [self._surface(), self._slice()]

    def _surface(self) -> Picture:
        with drawing(85) as figure:
            axes = figure.add_subplot(projection="3d", computed_zorder=False)
            assert isinstance(axes, Axes3D)
            pixels = np.arange(Z_MAX + 1)
            expected, measured = np.meshgrid(pixels, pixels)
            axes.plot_surface(
                expected,
                measured,
                self.table,
                cmap=MAP_OF_NUMBERS,
                norm=LogNorm(self.table.min(), self.table.max()),
                rcount=67,
                ccount=67,
                linewidth=0,
                antialiased=False,
                rasterized=True,
            )
            axes.set(xlabel="map says d (px)", ylabel="measured z (px)", zlabel="probability")
            axes.view_init(elev=32, azim=-125)
            axes.set_box_aspect((1.0, 1.0, 0.65), zoom=0.9)
            figure.set_layout_engine("none")  # it leaves the labels of a 3D plot outside
            axes.set_position((0.1, 0.0, 0.82, 1.0))
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(MultipleLocator(50))
            return finish(
                figure,
                "sensor-model-surface",
                "The sensor table as a surface; colours are logarithmic. The ridge is the wall where the map "
                "says it is, the edge at the back readings at the maximum.",
            )

    def _slice(self) -> Picture:
        with drawing(66) as figure:
            axes = figure.subplots()
            colors = (BLUE, ORANGE, VERMILLION, GREEN)
            for (name, part), color in zip(mixture_parts(_SLICE).items(), colors, strict=True):
                axes.plot(part, color=color, linewidth=0.9, label=name)
            axes.plot(self.table[:, _SLICE], "--", color=TRUTH, linewidth=1.0, label="all together")
            axes.set(
                xlabel=f"measured z (px), where the map says {_SLICE} px",
                ylabel="probability",
                yscale="log",
                ylim=(1e-5, 0.15),
            )
            legend_below(figure, columns=3)
            return finish(
                figure,
                "sensor-model-slice",
                f"A column of the table, where the map says {_SLICE} px, and the four parts that it is "
                "made of.",
            )


def sensor_model(settings: ExperimentSettings, parallel: ParallelRuns) -> SensorModelResult:
    """The table as it is; nothing is measured."""
    return SensorModelResult(sensor_table())
