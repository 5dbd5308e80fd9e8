"""The course's autograder: how far two filters are from the truth on a fixed drive, and the grades for it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.experiments.figure_style import (
    COLORS,
    COURSE_NAME,
    MAP_OF_NUMBERS,
    OURS_NAME,
    Pictures,
    height_of_map,
)
from racecar.pipelines.experiments.filters import (
    FilterSettings,
    both_filters,
    simulated_drive,
    start_filter,
    sweep,
)
from racecar.pipelines.experiments.result import (
    ExperimentResult,
    ExperimentSettings,
    FigureTable,
    plus_minus,
)
from racecar.pipelines.experiments.tracking import heading_errors, place_errors, track
from racecar.pipelines.files.pictures.map_picture import draw_grid
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
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
class Grades:
    """Of a scenario, one for each seed."""

    drives: Mapping[str, list[GradedDrive]]
    """By name of the filter."""
    truth: Trajectory
    """Of the first seed."""

    def deviations(self, name: str) -> NDArray[np.float64]:
        """(seeds,) metres."""
        return np.array([drive.deviation for drive in self.drives[name]])

    def headings(self, name: str) -> NDArray[np.float64]:
        """(seeds,) degrees."""
        return np.degrees([drive.heading_deviation for drive in self.drives[name]])

    @property
    def of_the_course(self) -> NDArray[np.float64]:
        """(seeds,) max(0, 1 − max(0, d − d_ref)), deviations in metres."""
        worse_by = self.deviations(OURS_NAME) - self.deviations(COURSE_NAME)
        return np.maximum(0.0, 1.0 - np.maximum(0.0, worse_by))

    @property
    def ratios(self) -> NDArray[np.float64]:
        """(seeds,) d_ref / d: 1 is as good as the reference, 2 is twice as near to the truth."""
        return self.deviations(COURSE_NAME) / self.deviations(OURS_NAME)


def autograde(settings: ExperimentSettings, parallel: ParallelRuns) -> ExperimentResult:
    """Three scenarios, 10 seeds each (2 on a shorter drive when quick)."""
    seeds, seconds = (2, 10.0) if settings.quick else (10, 30.0)
    configs = {
        scenario: config.model_copy(update={"seed": 1000 * settings.seed, "duration": seconds})
        for scenario, config in SCENARIOS.items()
    }
    variants = both_filters(settings.localization)
    cases = {
        (scenario, name): (config, variant)
        for scenario, config in configs.items()
        for name, variant in variants.items()
    }
    drives = sweep(parallel, "Autograde", grade_drive, cases, seeds)
    firsts = {scenario: simulated_drive(_MAP, config) for scenario, config in configs.items()}
    grades = {
        scenario: Grades({name: drives[scenario, name] for name in variants}, drive.truth)
        for scenario, drive in firsts.items()
    }
    return ExperimentResult(
        "Autograder: deviation from the truth on a fixed drive",
        _text(grades, seeds),
        [_table(grades)],
        {
            scenario: {
                "deviation_m": {name: of_one.deviations(name) for name in variants},
                "heading_deviation_deg": {name: of_one.headings(name) for name in variants},
                "course_grade": of_one.of_the_course,
                "reference_over_ours": of_one.ratios,
            }
            for scenario, of_one in grades.items()
        },
        _pictures(grades, firsts["full"].grid),
    )


def grade_drive(config: SimulationConfig, variant: FilterSettings, seed: int) -> GradedDrive:
    """One filter on one drive, started where the car starts."""
    config = config.model_copy(update={"seed": config.seed + seed})
    drive = simulated_drive(_MAP, config)
    true = drive.truth.map_from_base
    filter_ = start_filter(variant, drive.grid, true[0], _START, np.random.default_rng([config.seed, 4]))
    estimated = track(filter_, drive.messages).map_from_base
    return GradedDrive(
        estimated,
        float(place_errors(estimated, true).mean()),
        float(heading_errors(estimated, true).mean()),
    )


def _text(grades: Mapping[str, Grades], seeds: int) -> list[str]:
    ratios = ", ".join(f"{of_one.ratios.mean():.1f} ({scenario})" for scenario, of_one in grades.items())
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
        f"as the reference, 2 is twice as near to the truth. It is {ratios}.",
    ]


def _table(grades: Mapping[str, Grades]) -> FigureTable:
    return FigureTable(
        "Mean absolute deviation, mean ± standard deviation over the seeds",
        (
            *("scenario", "d (m)", "d of the reference (m)", "heading (°)", "heading of the reference (°)"),
            *("course's grade", "d_ref / d"),
        ),
        [
            (
                scenario,
                *(plus_minus(of_one.deviations(name), 4) for name in COLORS),
                *(plus_minus(of_one.headings(name), 3) for name in COLORS),
                plus_minus(of_one.of_the_course, 3),
                plus_minus(of_one.ratios, 2),
            )
            for scenario, of_one in grades.items()
        ],
    )


def _pictures(grades: Mapping[str, Grades], grid: OccupancyGrid) -> Pictures:
    pictures = Pictures()
    shows = (
        "Mean distance from the true place, by scenario and filter; the bars' ends are the mean over the "
        "seeds, the whiskers their standard deviation."
    )
    with pictures.draw("autograde", 62, shows, legend_columns=2) as figure:
        axes = figure.subplots()
        for shift, name in ((-0.2, OURS_NAME), (0.2, COURSE_NAME)):
            centimetres = [100 * of_one.deviations(name) for of_one in grades.values()]
            axes.bar(
                np.arange(len(grades)) + shift,
                [values.mean() for values in centimetres],
                width=0.36,
                yerr=[values.std() for values in centimetres],
                capsize=2,
                error_kw={"elinewidth": 0.8},
                color=COLORS[name],
                label=f"{name} filter",
            )
        axes.set_xticks(range(len(grades)), list(grades))
        axes.set(xlabel="noise of the sensors", ylabel="mean deviation (cm)")
        axes.grid(visible=False, axis="x")
    shows = "The distance from the true place over time, for each scenario, first seed."
    with pictures.draw("autograde-deviation", 100, shows, legend_columns=2) as figure:
        panels = figure.subplots(len(grades), 1, sharex=True, sharey=True)
        for axes, (scenario, of_one) in zip(panels, grades.items(), strict=True):
            seconds = of_one.truth.stamps * 1e-9
            for name, drives in of_one.drives.items():
                errors = 100 * place_errors(drives[0].map_from_base, of_one.truth.map_from_base)
                style = {"color": COLORS[name], "label": f"{name} filter", "linewidth": 0.8}
                axes.plot(seconds - seconds[0], errors, **style)
            title = f"{scenario} noise".replace("no noise noise", "no noise")
            axes.set(title=title, ylabel="deviation (cm)")
        panels[-1].set_xlabel("time (s)")
    true, ours = grades["full"].truth.map_from_base, grades["full"].drives[OURS_NAME][0].map_from_base
    low, high = true[:, :2].min(axis=0) - 2.0, true[:, :2].max(axis=0) + 2.0
    shows = (
        "The drive on the map; the colour shows how far this library's filter was from it under full noise, "
        "first seed."
    )
    with pictures.draw("autograde-path", height_of_map(low, high, around_mm=26), shows) as figure:
        axes = figure.subplots()
        draw_grid(axes, grid)
        errors = 100 * place_errors(ours, true)
        x, y = true[:, :2].T
        drawn = axes.scatter(x, y, s=5, c=errors, cmap=MAP_OF_NUMBERS, linewidths=0, zorder=3)
        figure.colorbar(drawn, ax=axes, location="top", shrink=0.9, label="deviation (cm)")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.set(xlabel="x (m)", ylabel="y (m)")
        axes.grid(visible=False)
    return pictures
