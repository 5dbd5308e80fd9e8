"""How much motion noise a filter should assume: the response to a step from (0, 0, 0) to (1, 1, 0)."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.experiments.circle_drive import SCAN_PERIOD, CircleDrive
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import (
    FilterSettings,
    Measured,
    start_filter,
    sweep,
    track,
    with_motion_noise,
)
from racecar.pipelines.experiments.page import (
    COLORS,
    COURSE_NAME,
    OURS_NAME,
    TRUTH,
    Page,
    plus_minus,
    show_plain_ticks,
)
from racecar.pipelines.runs.evaluation.course_filter import CourseSettings
from racecar.pipelines.runs.parallel_runs import ParallelRuns

NOISES = (0.02, 0.10, 0.25, 0.5, 0.75, 1.0)
"""Standard deviations in metres and radians: per metre or radian for ours, per update for the course."""
JUMP = np.array([1.0, 1.0, 0.0])
"""(3,) metres and radians, as set by the course."""
_SECONDS, _JUMP_AFTER = 12.0, 2.0
"""Seconds: duration of a drive, and time of the jump."""
_AVERAGED = 20
"""Scans in the running average."""
_WITHIN = 0.25
"""Metres: an estimate has converged when its running average stays this close to the car's place."""
_FASTEST = np.ceil(_AVERAGED * (1.0 - _WITHIN)) * SCAN_PERIOD * 1e-9
"""Seconds until the running average is close enough if the estimate follows at once."""
_HARDLY = 0.01
"""Metres between the mean errors of the best and the worst noise, below which the choice hardly matters."""
_START = (0.05, 0.05, 0.05)
"""Standard deviations of the start: metres, metres, radians."""


Responses: TypeAlias = Mapping[str, Mapping[float, Measured]]
"""Results of `step_response`, by filter name and noise."""
_OWNERS = {OURS_NAME: "this library's", COURSE_NAME: "the course's"}
_FIGURES = {"seconds_to_converge": 2, "spread": 4, "mean_error": 3}
"""Results in the tables, and their number of digits."""


def noise_sweep(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """Both filters, each noise, 20 seeds (2 if quick)."""
    cases = {
        (name, noise): (variant, settings.seed)
        for noise in NOISES
        for name, variant in (
            (OURS_NAME, with_motion_noise(settings.localization, noise)),
            (COURSE_NAME, replace(CourseSettings(), noise=noise)),
        )
    }
    runs = sweep(parallel, "Noise sweep", step_response, cases, 2 if settings.quick else 20)
    return swept({name: {noise: runs[name, noise] for noise in NOISES} for name in _OWNERS})


def swept(responses: Responses) -> Page:
    """The page for step responses."""
    seeds = len(responses[OURS_NAME][NOISES[0]]["spread"])
    page = Page(
        "Motion noise: how fast the estimate follows, and how much it then scatters",
        f"A car drives circles of 1 m radius in a room of 10 × 8 m. After {_JUMP_AFTER:g} s it is moved "
        "from (0, 0, 0) to (1, 1, 0) of its path, which its odometry does not notice. The estimate has "
        f"to step after it. Each noise was tried with {seeds} seeds in both filters: this library's, "
        "whose noise is per metre or radian of motion (all four noises of its motion model alike, and "
        "no slip beside them), and the course's, whose noise is added by every update, 20 times a "
        "second.",
        f"The filter has converged when the average over {_AVERAGED} scans stays within {_WITHIN:g} m of "
        "the car in x and in y until the end; an estimate that follows at once needs "
        f"{_FASTEST:g} s for that. The spread is the standard deviation of the estimate about the car's "
        "place after that.",
        *(_choice(name, by_noise) for name, by_noise in responses.items()),
        *_why_the_course_is_fast(responses),
    )
    page.table(
        "Mean ± standard deviation over the seeds",
        (
            *("filter", "noise (m, rad)", "converged", "time to converge (s)"),
            *("spread afterwards (m)", "mean error after the jump (m)"),
        ),
        [
            (
                name,
                f"{noise:g}",
                f"{np.isfinite(run['seconds_to_converge']).mean():.0%}",
                *(plus_minus(run[key], digits) for key, digits in _FIGURES.items()),
            )
            for name, by_noise in responses.items()
            for noise, run in by_noise.items()
        ],
    )
    page.figures |= {
        "best_noise": {name: best(by_noise) for name, by_noise in responses.items()},
        "runs": {
            name: {f"{noise:g}": {key: run[key] for key in _FIGURES} for noise, run in by_noise.items()}
            for name, by_noise in responses.items()
        },
    }
    _draw(page, responses)
    return page


def best(by_noise: Mapping[float, Measured]) -> float:
    """The smallest noise whose mean error after the jump is the lowest within the limits of chance."""
    errors = {noise: run["mean_error"] for noise, run in by_noise.items()}
    lowest = min(errors.values(), key=np.mean)
    chance = 2.0 * lowest.std() / np.sqrt(len(lowest))
    return next(noise for noise, error in errors.items() if error.mean() <= lowest.mean() + chance)


def _choice(name: str, by_noise: Mapping[float, Measured]) -> str:
    noise = best(by_noise)
    seconds, spread, error = (np.nanmean(by_noise[noise][key]) for key in _FIGURES)
    means = [run["mean_error"].mean() for run in by_noise.values()]
    span = f"over the noises it goes from {min(means):.3f} to {max(means):.3f} m"
    speed = (
        f"With {noise:g} the filter converges in {seconds:.2f} s and then spreads by {100 * spread:.1f} cm."
    )
    if max(means) - min(means) < _HARDLY:
        return (
            f"For {_OWNERS[name]} filter the choice hardly matters. Its mean error after the jump counts "
            f"both the approach and the scatter afterwards; {span}. The least noise among the best is "
            f"{noise:g}. {speed}"
        )
    return (
        f"For {_OWNERS[name]} filter {noise:g} is the value to pick: the least noise whose mean error "
        "after the jump, which counts both the approach and the scatter afterwards, is within two "
        f"standard errors of the smallest. There it is {error:.3f} m; {span}. {speed}"
    )


def _why_the_course_is_fast(responses: Responses) -> list[str]:
    """If the course's filter converges sooner, the reason and the cost of that."""
    by_speed = {
        name: min((_seconds(run), noise, 100 * run["spread"].mean()) for noise, run in by_noise.items())
        for name, by_noise in responses.items()
    }
    (seconds, noise, spread), (course_seconds, course_noise, course_spread) = (
        by_speed[name] for name in (OURS_NAME, COURSE_NAME)
    )
    if not course_seconds < seconds:
        return []
    return [
        f"By the time to converge alone the course's filter wins: {course_seconds:.2f} s at a noise "
        f"of {course_noise:g} against {seconds:.2f} s at {noise:g}. It adds its noise with every "
        "update, whether the car moves or not, so that some of its particles are always near the new "
        "place; this library's filter spreads its particles only as far as the motion allows, and moves "
        "to another place when several scans in a row speak for it. The price is that the cloud stays "
        f"wide: the course's estimate then spreads by {course_spread:.1f} cm, this "
        f"library's by {spread:.1f} cm. The criterion rewards speed after a "
        "jump, which no car makes by itself; the mean error after the jump counts both.",
    ]


def _seconds(run: Measured) -> float:
    """Mean seconds until the filter has converged; infinite if it does not with some seed."""
    return float(np.nan_to_num(run["seconds_to_converge"], nan=np.inf).mean())


def _draw(page: Page, responses: Responses) -> None:
    for name, by_noise in responses.items():
        shows = (
            f"The estimate of {_OWNERS[name]} filter over time, first seed, for each noise: x less where the "
            f"car would be without the jump, and its running average over {_AVERAGED} scans."
        )
        with page.draw(f"noise-sweep-traces-{name}", 105, shows, legend_columns=3) as figure:
            panels = figure.subplots(3, 2, sharex=True, sharey=True)
            for axes, (noise, run) in zip(panels.flat, by_noise.items(), strict=True):
                _draw_trace(axes, run["offsets"][0, :, 0], COLORS[name])
                axes.set(title=f"noise {noise:g}", ylim=(-0.6, 2.1))
            for axes in panels[-1]:
                axes.set_xlabel("time since the jump (s)")
            for axes in panels[:, 0]:
                axes.set_ylabel("x (m)")
    shows = (
        "Time to converge and spread of the estimate afterwards against the noise: mean and standard "
        "deviation over the seeds. A noise with which some seed did not converge is shown without a time."
    )
    with page.draw("noise-sweep", 100, shows, legend_columns=2) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        for shift, (name, by_noise) in zip((0.97, 1.03), responses.items(), strict=True):
            for axes, key, unit in ((above, "seconds_to_converge", 1.0), (below, "spread", 100.0)):
                values = unit * np.array([run[key] for run in by_noise.values()])
                is_whole = np.isfinite(values).all(axis=1)
                axes.errorbar(
                    np.array(NOISES)[is_whole] * shift,
                    values[is_whole].mean(axis=1),
                    values[is_whole].std(axis=1),
                    color=COLORS[name],
                    marker="o",
                    capsize=2,
                    elinewidth=0.8,
                    label=f"{name} filter",
                )
        below.set_xscale("log")
        show_plain_ticks(below.xaxis, NOISES)
        above.set(ylabel="time to converge (s)", ylim=(0, None))
        below.set(xlabel="motion noise (m, rad)", ylabel="spread afterwards (cm)", yscale="log")
        show_plain_ticks(below.yaxis, (1, 2, 5, 10, 20, 50))


def _draw_trace(axes: Axes, x: NDArray[np.float64], color: str) -> None:
    seconds = _drive().truth.stamps * 1e-9 - _JUMP_AFTER
    axes.axvline(0.0, color="#9aa3ad", linewidth=0.6)
    target = np.where(seconds > 0, JUMP[0], 0.0)
    axes.plot(seconds, target, "--", color=TRUTH, linewidth=0.8, label="true x")
    axes.plot(seconds, x, color=color, alpha=0.45, linewidth=0.6, label="estimated x")
    axes.plot(seconds[_AVERAGED - 1 :], running_mean(x), color=color, label=f"mean of {_AVERAGED}")


def step_response(variant: FilterSettings, seed: int, index: int) -> dict[str, Any]:
    """Run one drive with a jump; the seeds 0, 1, 2, … of all variants see the same scans."""
    drive = _drive()
    truth = drive.truth
    filter_ = start_filter(variant, drive.grid, IDENTITY, _START, np.random.default_rng([seed, index, 1]))
    estimated = track(filter_, drive.messages(np.random.default_rng([seed, index, 2]))).map_from_base
    is_after = truth.stamps * 1e-9 > _JUMP_AFTER
    offsets = (estimated - truth.map_from_base)[:, :2] + np.where(is_after[:, None], JUMP[:2], 0.0)
    return measure_step(offsets, is_after)


def _drive() -> CircleDrive:
    return CircleDrive(_SECONDS, JUMP, _JUMP_AFTER)


def measure_step(offsets: NDArray[np.float64], is_after: NDArray[np.bool_]) -> dict[str, Any]:
    """Results from offsets (S, 2) of an estimate to the car's place without the jump, which should go from 0
    to 1, and which of them (S,) are after the jump."""
    errors = offsets[is_after] - JUMP[:2]
    averaged = np.column_stack([running_mean(axis) for axis in offsets.T])[-len(errors) :] - JUMP[:2]
    is_far = np.any(np.abs(averaged) > _WITHIN, axis=1)
    first = int(np.max(np.flatnonzero(is_far), initial=-1)) + 1
    has_converged = first < len(errors)
    converged = errors[first:] if has_converged else errors[-len(errors) // 3 :]
    return {
        "offsets": offsets,
        "seconds_to_converge": (first + 1) * SCAN_PERIOD * 1e-9 if has_converged else np.nan,
        "spread": np.sqrt(np.mean(np.sum(converged**2, axis=1))),
        "mean_error": np.mean(np.hypot(*errors.T)),
    }


def running_mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N - 19,) means of each value and the 19 before it."""
    return np.convolve(values, np.full(_AVERAGED, 1.0 / _AVERAGED), mode="valid")
