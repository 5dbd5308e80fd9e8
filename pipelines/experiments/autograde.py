"""The course's autograder: errors of two filters on a fixed drive, and the grades for them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import (
    FilterSettings,
    Measured,
    both_filters,
    heading_errors,
    place_errors,
    simulated_drive,
    start_filter,
    sweep,
    track,
)
from racecar.pipelines.experiments.page import (
    COLORS,
    COURSE_NAME,
    MAP_OF_NUMBERS,
    OURS_NAME,
    Page,
    height_of_map,
    plus_minus,
)
from racecar.pipelines.files.pictures.grid_drawing import draw_grid
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

SCENARIOS: Mapping[str, SimulationConfig] = {
    "no noise": SimulationConfig(noise=NoiseLevel.NONE, range_noise=0.0, dropouts=0.0),
    "slight": SimulationConfig(noise=NoiseLevel.SLIGHT, range_noise=0.01, dropouts=0.002),
    "full": SimulationConfig(noise=NoiseLevel.FULL, range_noise=0.03, dropouts=0.01),
}
_MAP = "track"
_START = (0.1, 0.1, 0.05)


def autograde(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """Three scenarios, 10 seeds each (2 on a shorter drive if quick)."""
    seeds, seconds = (2, 10.0) if settings.quick else (10, 30.0)
    configs = {
        scenario: config.model_copy(update={"seed": 1000 * settings.seed, "duration": seconds})
        for scenario, config in SCENARIOS.items()
    }
    cases = {
        (scenario, name): (config, variant)
        for scenario, config in configs.items()
        for name, variant in both_filters(settings.localization).items()
    }
    runs = sweep(parallel, "Autograde", grade_drive, cases, seeds)
    grades = {scenario: graded({name: runs[scenario, name] for name in COLORS}) for scenario in configs}
    ratios = ", ".join(
        f"{figures['reference_over_ours'].mean():.1f} ({scenario})" for scenario, figures in grades.items()
    )
    firsts = {scenario: simulated_drive(_MAP, config) for scenario, config in configs.items()}
    page = Page(
        "Autograder: deviation from the truth on a fixed drive",
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
    )
    page.figures |= grades
    _tabulate(page, grades)
    _draw(page, runs, firsts)
    _draw_path(page, firsts["full"], 100 * runs["full", OURS_NAME]["errors_m"][0])
    return page


def grade_drive(config: SimulationConfig, variant: FilterSettings, seed: int) -> dict[str, Any]:
    """Run one filter on one drive, started at the car's pose."""
    config = config.model_copy(update={"seed": config.seed + seed})
    drive = simulated_drive(_MAP, config)
    true = drive.truth.map_from_base
    filter_ = start_filter(variant, drive.grid, true[0], _START, np.random.default_rng([config.seed, 4]))
    estimated = track(filter_, drive.messages).map_from_base
    errors = place_errors(estimated, true)
    return {
        "deviation_m": errors.mean(),
        "heading_deviation_deg": heading_errors(estimated, true).mean(),
        "errors_m": errors,
    }


def graded(runs: Mapping[str, Measured]) -> dict[str, Any]:
    """Both deviations by filter, and both grades, (seeds,) each, from a scenario's runs by filter."""
    deviations = {
        figure: {name: measured[figure] for name, measured in runs.items()}
        for figure in ("deviation_m", "heading_deviation_deg")
    }
    ours, course = (deviations["deviation_m"][name] for name in (OURS_NAME, COURSE_NAME))
    return {
        **deviations,
        "course_grade": np.maximum(0.0, 1.0 - np.maximum(0.0, ours - course)),
        "reference_over_ours": course / ours,
    }


def _tabulate(page: Page, grades: Mapping[str, Mapping[str, Any]]) -> None:
    page.table(
        "Mean absolute deviation, mean ± standard deviation over the seeds",
        (
            *("scenario", "d (m)", "d of the reference (m)", "heading (°)", "heading of the reference (°)"),
            *("course's grade", "d_ref / d"),
        ),
        [
            (
                scenario,
                *(plus_minus(figures["deviation_m"][name], 4) for name in COLORS),
                *(plus_minus(figures["heading_deviation_deg"][name], 3) for name in COLORS),
                plus_minus(figures["course_grade"], 3),
                plus_minus(figures["reference_over_ours"], 2),
            )
            for scenario, figures in grades.items()
        ],
    )


def _draw(page: Page, runs: Mapping[tuple[str, str], Measured], firsts: Mapping[str, SimulatedDrive]) -> None:
    shows = (
        "Mean distance from the true place, by scenario and filter; the bars' ends are the mean over the "
        "seeds, the whiskers their standard deviation."
    )
    with page.draw("autograde", 62, shows, legend_columns=2) as figure:
        axes = figure.subplots()
        for shift, name in ((-0.2, OURS_NAME), (0.2, COURSE_NAME)):
            centimetres = [100 * runs[scenario, name]["deviation_m"] for scenario in firsts]
            axes.bar(
                np.arange(len(firsts)) + shift,
                [values.mean() for values in centimetres],
                width=0.36,
                yerr=[values.std() for values in centimetres],
                capsize=2,
                error_kw={"elinewidth": 0.8},
                color=COLORS[name],
                label=f"{name} filter",
            )
        axes.set_xticks(range(len(firsts)), list(firsts))
        axes.set(xlabel="noise of the sensors", ylabel="mean deviation (cm)")
        axes.grid(visible=False, axis="x")
    shows = "The distance from the true place over time, for each scenario, first seed."
    with page.draw("autograde-deviation", 100, shows, legend_columns=2) as figure:
        panels = figure.subplots(len(firsts), 1, sharex=True, sharey=True)
        for axes, (scenario, drive) in zip(panels, firsts.items(), strict=True):
            seconds = drive.truth.stamps * 1e-9
            for name, color in COLORS.items():
                errors = 100 * runs[scenario, name]["errors_m"][0]
                style = {"color": color, "label": f"{name} filter", "linewidth": 0.8}
                axes.plot(seconds - seconds[0], errors, **style)
            title = f"{scenario} noise".replace("no noise noise", "no noise")
            axes.set(title=title, ylabel="deviation (cm)")
        panels[-1].set_xlabel("time (s)")


def _draw_path(page: Page, drive: SimulatedDrive, centimetres: NDArray[np.float64]) -> None:
    places = drive.truth.map_from_base[:, :2]
    low, high = places.min(axis=0) - 2.0, places.max(axis=0) + 2.0
    shows = (
        "The drive on the map; the colour shows how far this library's filter was from it under full noise, "
        "first seed."
    )
    with page.draw("autograde-path", height_of_map(low, high, around_mm=26), shows) as figure:
        axes = figure.subplots()
        draw_grid(axes, drive.grid, low, high)
        drawn = axes.scatter(
            places[:, 0], places[:, 1], s=5, c=centimetres, cmap=MAP_OF_NUMBERS, linewidths=0, zorder=3
        )
        figure.colorbar(drawn, ax=axes, location="top", shrink=0.9, label="deviation (cm)")
        axes.set(xlabel="x (m)", ylabel="y (m)")
