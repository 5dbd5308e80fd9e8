"""The course's autograder: how far two filters are from the truth on a fixed drive, and the grades for it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.evaluation.course_filter import CourseSettings
from racecar.pipelines.experiments.figure_style import (
    COURSE_NAME,
    MAP_OF_NUMBERS,
    OURS_NAME,
    Picture,
    drawing,
    finish,
    height_of_map,
    legend_below,
)
from racecar.pipelines.experiments.filters import COLORS, start_filter
from racecar.pipelines.experiments.result import ExperimentSettings, FigureTable
from racecar.pipelines.experiments.shared_drives import simulated_drive
from racecar.pipelines.experiments.tracking import heading_errors, place_errors, track
from racecar.pipelines.pictures.map_picture import draw_grid
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

SCENARIOS: Mapping[str, SimulationConfig] = {
    "no noise": SimulationConfig(noise=NoiseLevel.NONE, range_noise=0.0, dropouts=0.0),
    "slight": SimulationConfig(noise=NoiseLevel.SLIGHT, range_noise=0.01, dropouts=0.002),
    "full": SimulationConfig(noise=NoiseLevel.FULL, range_noise=0.03, dropouts=0.01),
}
_MAP = "track"
_START = (0.1, 0.1, 0.05)


@dataclass(frozen=True, eq=False)
class GradedDrive:
    """A filter's drive."""

    map_from_base: Pose
    """(S, 3)"""
    deviation: float
    """Metres: mean over the scans of the distance to the true place."""
    heading_deviation: float
    """Radians, the same for the heading."""


@dataclass(frozen=True, eq=False)
class Autograde:
    """Drives of both filters by scenario and name of the filter, one for each seed."""

    drives: Mapping[str, Mapping[str, list[GradedDrive]]]
    truths: Mapping[str, Trajectory]
    """By scenario."""
    grid: OccupancyGrid
    title: str = "Autograder: deviation from the truth on a fixed drive"

    def course_grades(self, scenario: str) -> NDArray[np.float64]:
        """(seeds,) max(0, 1 − max(0, d − d_ref)), deviations in metres."""
        ours, reference = self._deviations(scenario, OURS_NAME), self._deviations(scenario, COURSE_NAME)
        return np.maximum(0.0, 1.0 - np.maximum(0.0, ours - reference))

    def ratios(self, scenario: str) -> NDArray[np.float64]:
        """(seeds,) d_ref / d: 1 is as good as the reference, 2 is twice as near to the truth."""
        return self._deviations(scenario, COURSE_NAME) / self._deviations(scenario, OURS_NAME)

    def text(self) -> list[str]:
        seeds = len(self.drives["full"][OURS_NAME])
        grades = ", ".join(f"{self.ratios(scenario).mean():.1f} ({scenario})" for scenario in self.drives)
        return [
            "The same drive on the shipped track under three scenarios: sensors without any noise, with "
            "the slight noise of a well kept car, and with full noise (scale errors of per cents, slip, "
            f"ranges with 3 cm of noise, lost beams). Each with {seeds} seeds. The reference is a filter "
            f"written plainly as the course teaches it: {CourseSettings().particles} particles, "
            f"{CourseSettings().beams} beams, the course's sensor table, Gaussian motion noise. The "
            "deviation d is the mean distance from the true place over all scans.",
            "The course's grade is max(0, 1 − max(0, d − d_ref)) with d in metres. It stops at 1: a filter "
            "that is nearer to the truth than the reference gets the same as an equal one, and one that is "
            "ten centimetres worse loses no more than a tenth. The second grade is d_ref / d: 1 is as good "
            f"as the reference, 2 is twice as near to the truth. It is {grades}.",
        ]

    def tables(self) -> list[FigureTable]:
        columns = (
            *("scenario", "d (m)", "d of the reference (m)", "heading (°)", "heading of the reference (°)"),
            *("course's grade", "d_ref / d"),
        )
        rows = [
            (
                scenario,
                *(_plus_minus(self._deviations(scenario, name), 4) for name in (OURS_NAME, COURSE_NAME)),
                *(_plus_minus(self._headings(scenario, name), 3) for name in (OURS_NAME, COURSE_NAME)),
                _plus_minus(self.course_grades(scenario), 3),
                _plus_minus(self.ratios(scenario), 2),
            )
            for scenario in self.drives
        ]
        return [
            FigureTable("Mean absolute deviation, mean ± standard deviation over the seeds", columns, rows)
        ]

    def figures(self) -> dict[str, Any]:
        return {
            scenario: {
                "deviation_m": {name: self._deviations(scenario, name) for name in by_name},
                "heading_deviation_deg": {name: self._headings(scenario, name) for name in by_name},
                "course_grade": self.course_grades(scenario),
                "reference_over_ours": self.ratios(scenario),
            }
            for scenario, by_name in self.drives.items()
        }

    def pictures(self) -> list[Picture]:
        return [self._bars(), self._over_time(), self._path()]

    def _bars(self) -> Picture:
        with drawing(62) as figure:
            axes = figure.subplots()
            for shift, name in ((-0.2, OURS_NAME), (0.2, COURSE_NAME)):
                centimetres = [100 * self._deviations(scenario, name) for scenario in self.drives]
                axes.bar(
                    np.arange(len(centimetres)) + shift,
                    [values.mean() for values in centimetres],
                    width=0.36,
                    yerr=[values.std() for values in centimetres],
                    capsize=2,
                    error_kw={"elinewidth": 0.8},
                    color=COLORS[name],
                    label=f"{name} filter",
                )
            axes.set_xticks(range(len(self.drives)), list(self.drives))
            axes.set(xlabel="noise of the sensors", ylabel="mean deviation (cm)")
            axes.grid(visible=False, axis="x")
            legend_below(figure)
            return finish(
                figure,
                "autograde",
                "Mean distance from the true place, by scenario and filter; the bars' ends are the mean over "
                "the seeds, the whiskers their standard deviation.",
            )

    def _over_time(self) -> Picture:
        with drawing(100) as figure:
            panels = figure.subplots(len(self.drives), 1, sharex=True, sharey=True)
            for axes, (scenario, by_name) in zip(panels, self.drives.items(), strict=True):
                for name, drives in by_name.items():
                    errors = place_errors(drives[0].map_from_base, self.truths[scenario].map_from_base)
                    seconds = self.truths[scenario].stamps * 1e-9
                    axes.plot(
                        seconds - seconds[0],
                        100 * errors,
                        color=COLORS[name],
                        linewidth=0.8,
                        label=f"{name} filter",
                    )
                axes.set(
                    title=f"{scenario} noise".replace("no noise noise", "no noise"), ylabel="deviation (cm)"
                )
            panels[-1].set_xlabel("time (s)")
            legend_below(figure)
            return finish(
                figure,
                "autograde-deviation",
                "The distance from the true place over time, for each scenario, first seed.",
            )

    def _path(self) -> Picture:
        true, ours = self.truths["full"].map_from_base, self.drives["full"][OURS_NAME][0].map_from_base
        low, high = true[:, :2].min(axis=0) - 2.0, true[:, :2].max(axis=0) + 2.0
        with drawing(height_of_map(low, high, around_mm=26)) as figure:
            axes = figure.subplots()
            draw_grid(axes, self.grid)
            errors = 100 * place_errors(ours, true)
            x, y = true[:, :2].T
            drawn = axes.scatter(x, y, s=5, c=errors, cmap=MAP_OF_NUMBERS, linewidths=0, zorder=3)
            figure.colorbar(drawn, ax=axes, location="top", shrink=0.9, label="deviation (cm)")
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            axes.set(xlabel="x (m)", ylabel="y (m)")
            axes.grid(visible=False)
            return finish(
                figure,
                "autograde-path",
                "The drive on the map; the colour shows how far this library's filter was from it under full "
                "noise, first seed.",
            )

    def _deviations(self, scenario: str, name: str) -> NDArray[np.float64]:
        return np.array([drive.deviation for drive in self.drives[scenario][name]])

    def _headings(self, scenario: str, name: str) -> NDArray[np.float64]:
        return np.degrees([drive.heading_deviation for drive in self.drives[scenario][name]])


def autograde(settings: ExperimentSettings, parallel: ParallelRuns) -> Autograde:
    """Three scenarios, 10 seeds each (2 on a shorter drive when quick)."""
    seeds, seconds = (range(2), 10.0) if settings.quick else (range(10), 30.0)
    variants: dict[str, LocalizationConfig | CourseSettings] = {
        OURS_NAME: settings.localization,
        COURSE_NAME: CourseSettings(),
    }
    drives = {
        (scenario, seed): config.model_copy(update={"seed": 1000 * settings.seed + seed, "duration": seconds})
        for scenario, config in SCENARIOS.items()
        for seed in seeds
    }
    arguments = [(config, variant) for config in drives.values() for variant in variants.values()]
    done = iter(parallel.run("Autograde", grade_drive, arguments))
    graded = {key: {name: next(done) for name in variants} for key in drives}
    truths = {name: simulated_drive(_MAP, drives[name, 0]) for name in SCENARIOS}
    return Autograde(
        {
            scenario: {name: [graded[scenario, seed][name] for seed in seeds] for name in variants}
            for scenario in SCENARIOS
        },
        {scenario: drive.truth for scenario, drive in truths.items()},
        truths["full"].grid,
    )


def grade_drive(config: SimulationConfig, variant: LocalizationConfig | CourseSettings) -> GradedDrive:
    """One filter on one drive, started where the car starts."""
    drive = simulated_drive(_MAP, config)
    true = drive.truth.map_from_base
    filter_ = start_filter(variant, drive.grid, true[0], _START, np.random.default_rng([config.seed, 4]))
    estimated = track(filter_, drive.messages).map_from_base
    return GradedDrive(
        estimated,
        float(place_errors(estimated, true).mean()),
        float(heading_errors(estimated, true).mean()),
    )


def _plus_minus(values: NDArray[np.float64], digits: int) -> str:
    return f"{values.mean():.{digits}f} ± {values.std():.{digits}f}"
