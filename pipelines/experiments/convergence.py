"""How fast a cloud of 0.5 m converges to the car, and how wide it stays."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.experiments.circle_drive import CircleDrive
from racecar.pipelines.experiments.experiment import ExperimentSettings
from racecar.pipelines.experiments.filters import (
    FilterSettings,
    Measured,
    both_filters,
    cloud_spread,
    start_filter,
    sweep,
    track,
)
from racecar.pipelines.experiments.page import COLORS, Page, plus_minus, show_plain_ticks
from racecar.pipelines.experiments.recording import Recording
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_SPREAD = (0.5, 0.5, 0.25)
"""Standard deviations of the start: metres, metres, radians."""
_SECONDS, _SHOWN = 10.0, 3.0
"""Seconds: duration of a drive, and of the part shown in the figures."""
SMALL = 0.5
"""Metres between the extreme particles, in x and in y, that count as small."""
_FIGURES = ("seconds_until_small", "extent_afterwards_m", "deviation_afterwards_m")


def convergence(settings: ExperimentSettings, parallel: ParallelRuns) -> Page:
    """Both filters in the lab room, 20 seeds (3 if quick), and on a recording if there is one."""
    places: dict[str, Recording | None] = {"lab room": None}
    if settings.recording is not None:
        places[settings.recording.title] = settings.recording
    cases = {
        (place, name): (variant, recording, settings.seed)
        for place, recording in places.items()
        for name, variant in both_filters(settings.localization).items()
    }
    return converged(sweep(parallel, "Convergence", converge, cases, 3 if settings.quick else 20))


def converge(variant: FilterSettings, recording: Recording | None, seed: int, index: int) -> dict[str, Any]:
    """Run one filter from one start; the same seed and index give both filters the same start."""
    rng = np.random.default_rng([seed, index, 3])
    if recording is None:
        drive = CircleDrive(_SECONDS)
        grid, start, messages = drive.grid, IDENTITY, list(drive.messages(rng))
    else:
        assert recording.start is not None, "the command has searched for it"
        grid, start, messages = recording.grid, recording.start, recording.first(_SECONDS)
    off = rng.standard_normal(3) * _SPREAD
    filter_ = start_filter(variant, grid, start + off, _SPREAD, np.random.default_rng([seed, index, 4]))
    extent, deviation = cloud_spread(filter_)
    run = track(filter_, messages)
    seconds = np.append(0.0, run.seconds + np.median(np.diff(run.seconds)))  # first scan after a period
    return collapse(seconds, np.vstack([extent, run.extents]), np.append(deviation, run.deviations))


def collapse(
    seconds: NDArray[np.float64], extents: NDArray[np.float64], deviations: NDArray[np.float64]
) -> dict[str, Any]:
    """Figures of a cloud over times (S,): its extents (S, 2) and deviations (S,), the time after which the
    extent stays small in x and in y (nan if it does not), and the means of both over the last half."""
    first = int(np.max(np.flatnonzero(np.any(extents >= SMALL, axis=1)), initial=-1)) + 1
    half = len(seconds) // 2
    return {
        "seconds": seconds,
        "extents_m": extents.max(axis=1),
        "deviations_m": deviations,
        "seconds_until_small": seconds[first] if first < len(seconds) else np.nan,
        "extent_afterwards_m": extents[half:].mean(),
        "deviation_afterwards_m": deviations[half:].mean(),
    }


def converged(runs: Mapping[tuple[str, str], Measured]) -> Page:
    """The page for the runs by place and filter."""
    places = list(dict.fromkeys(place for place, _ in runs))
    page = Page(
        "Convergence: from a spread of 0.5 m",
        f"The particles start spread normally by {_SPREAD[0]:g} m in x and y and {_SPREAD[2]:g} rad "
        "about a pose that is itself off by a draw from the same spread; "
        f"{len(next(iter(runs.values()))['seconds'])} seeds. The extent of "
        "the cloud is its last particle less its first, in x and in y. It is small when both stay "
        f"below {SMALL:g} m until the end.",
        "The extent is a hard measure: one particle out of thousands decides it. This library's filter "
        "always tries a few particles away from the cloud, to find the car again when it is lost, so "
        "the standard deviation is given as well.",
    )
    page.table(
        "Mean ± standard deviation over the seeds",
        (
            *("drive", "filter", "seeds", "time until small (s)", "not small"),
            *("extent afterwards (m)", "standard deviation afterwards (m)"),
        ),
        [
            (
                *(place, name, f"{len(found['seconds'])}"),
                plus_minus(found["seconds_until_small"], 2),
                f"{np.isnan(found['seconds_until_small']).sum()}",
                plus_minus(found["extent_afterwards_m"], 3),
                plus_minus(found["deviation_afterwards_m"], 4),
            )
            for (place, name), found in runs.items()
        ],
    )
    page.figures |= {
        place: {
            name: {figure: found[figure] for figure in _FIGURES}
            for (at, name), found in runs.items()
            if at == place
        }
        for place in places
    }
    _draw(page, runs, places)
    return page


def _draw(page: Page, runs: Mapping[tuple[str, str], Measured], places: list[str]) -> None:
    """Draw the clouds over time, one figure per place."""
    for number, place in enumerate(places, start=1):
        shows = (
            f"The cloud over time, {place}: above its extent, the larger of x and y; below its standard "
            "deviation. Lines are the median over the seeds, bands hold eight seeds of ten."
        )
        suffix = "" if number == 1 else f"-{number}"
        with page.draw(f"convergence{suffix}", 98, shows, legend_columns=3) as figure:
            panels = figure.subplots(2, 1, sharex=True)
            for name, found in ((name, found) for (at, name), found in runs.items() if at == place):
                for axes, values in zip(panels, (found["extents_m"], found["deviations_m"]), strict=True):
                    low, middle, high = np.quantile(values, [0.1, 0.5, 0.9], axis=0)
                    seconds = found["seconds"][0]
                    axes.fill_between(seconds, low, high, color=COLORS[name], alpha=0.25, linewidth=0)
                    axes.plot(seconds, middle, color=COLORS[name], label=f"{name} filter")
            panels[0].axhline(SMALL, color="black", linestyle=":", linewidth=0.8, label="small")
            panels[0].set(ylabel="extent (m)", yscale="log", ylim=(0.03, 8))
            panels[1].set(ylabel="standard deviation (m)", yscale="log", ylim=(0.004, 1.5))
            panels[1].set(xlabel="time (s)", xlim=(0, _SHOWN))
            show_plain_ticks(panels[0].yaxis, (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5))
            show_plain_ticks(panels[1].yaxis, (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1))
