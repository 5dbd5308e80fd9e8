"""How fast a cloud of 0.5 m collapses about the car, and how wide it stays."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.experiments.figure_style import COLORS, Pictures, show_plain_ticks
from racecar.pipelines.experiments.filters import FilterSettings, both_filters, start_filter, sweep
from racecar.pipelines.experiments.lab_room import CircleDrive, draw_lab_room
from racecar.pipelines.experiments.recording import Recording, first_seconds, known_start
from racecar.pipelines.experiments.result import (
    ExperimentResult,
    ExperimentSettings,
    FigureTable,
    plus_minus,
)
from racecar.pipelines.experiments.tracking import Track, track
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_SPREAD = (0.5, 0.5, 0.25)
"""Standard deviations of the start: metres, metres, radians."""
_SECONDS, _SHOWN = 10.0, 3.0
"""How long a drive is, and how much of it the figures show."""
SMALL = 0.5
"""Metres from the first to the last particle, in x and in y, that count as small."""


def convergence(settings: ExperimentSettings, parallel: ParallelRuns) -> ExperimentResult:
    """Both filters in the lab room, 20 seeds (3 when quick), and on a recording when there is one."""
    places: dict[str, Recording | None] = {"lab room": None}
    if settings.recording is not None:
        places[settings.recording.title] = settings.recording
    cases = {
        (place, name): (variant, recording, settings.seed)
        for place, recording in places.items()
        for name, variant in both_filters(settings.localization).items()
    }
    return converged(sweep(parallel, "Convergence", converge, cases, 3 if settings.quick else 20))


def converge(variant: FilterSettings, recording: Recording | None, seed: int, index: int) -> Track:
    """One filter from one start; the same seed and index start alike in both."""
    rng = np.random.default_rng([seed, index, 3])
    if recording is None:
        drive = CircleDrive(draw_lab_room(), _SECONDS, np.zeros(3), np.inf)
        grid, start, messages = drive.grid, np.zeros(3), list(drive.messages(rng))
    else:
        messages = list(first_seconds(recording.messages(), _SECONDS))
        grid, start = recording.load_map(), known_start(recording)
    off = rng.standard_normal(3) * _SPREAD
    filter_ = start_filter(variant, grid, start + off, _SPREAD, np.random.default_rng([seed, index, 4]))
    return track(filter_, messages, with_start=True)


def converged(tracks: Mapping[tuple[str, str], Sequence[Track]]) -> ExperimentResult:
    """Of the tracks by where they were driven and by filter, one for each seed."""
    measured = {
        case: {
            "seconds_until_small": np.array([seconds_until_small(run) for run in runs]),
            "extent_afterwards_m": np.array([_last_half(run.extents).mean() for run in runs]),
            "deviation_afterwards_m": np.array([_last_half(run.deviations).mean() for run in runs]),
        }
        for case, runs in tracks.items()
    }
    places = dict.fromkeys(place for place, _ in tracks)
    return ExperimentResult(
        "Convergence: from a spread of 0.5 m",
        [
            f"The particles start spread normally by {_SPREAD[0]:g} m in x and y and {_SPREAD[2]:g} rad "
            "about a pose that is itself off by a draw from the same spread; "
            f"{len(next(iter(tracks.values())))} seeds. The extent of "
            "the cloud is its last particle less its first, in x and in y. It is small when both stay "
            f"below {SMALL:g} m until the end.",
            "The extent is a hard measure: one particle out of thousands decides it. This library's filter "
            "always tries a few particles away from the cloud, to find the car again when it is lost, so "
            "the standard deviation is given as well.",
        ],
        [
            FigureTable(
                "Mean ± standard deviation over the seeds",
                (
                    *("drive", "filter", "seeds", "time until small (s)", "not small"),
                    *("extent afterwards (m)", "standard deviation afterwards (m)"),
                ),
                [
                    (
                        *(place, name, f"{len(found['seconds_until_small'])}"),
                        plus_minus(found["seconds_until_small"], 2),
                        f"{np.isnan(found['seconds_until_small']).sum()}",
                        plus_minus(found["extent_afterwards_m"], 3),
                        plus_minus(found["deviation_afterwards_m"], 4),
                    )
                    for (place, name), found in measured.items()
                ],
            )
        ],
        {place: {name: found for (at, name), found in measured.items() if at == place} for place in places},
        _pictures(tracks, list(places)),
    )


def _pictures(tracks: Mapping[tuple[str, str], Sequence[Track]], places: Sequence[str]) -> Pictures:
    """The clouds over time, a figure for each place."""
    pictures = Pictures()
    for number, place in enumerate(places, start=1):
        shows = (
            f"The cloud over time, {place}: above its extent, the larger of x and y; below its standard "
            "deviation. Lines are the median over the seeds, bands hold eight seeds of ten."
        )
        suffix = "" if number == 1 else f"-{number}"
        with pictures.draw(f"convergence{suffix}", 98, shows, legend_columns=3) as figure:
            panels = figure.subplots(2, 1, sharex=True)
            for name, runs in ((name, runs) for (at, name), runs in tracks.items() if at == place):
                seconds = seconds_from_start(runs[0])
                for axes, values in (
                    (panels[0], np.array([run.extents.max(axis=1) for run in runs])),
                    (panels[1], np.array([run.deviations for run in runs])),
                ):
                    low, middle, high = np.quantile(values, [0.1, 0.5, 0.9], axis=0)
                    axes.fill_between(seconds, low, high, color=COLORS[name], alpha=0.25, linewidth=0)
                    axes.plot(seconds, middle, color=COLORS[name], label=f"{name} filter")
            panels[0].axhline(SMALL, color="black", linestyle=":", linewidth=0.8, label="small")
            panels[0].set(ylabel="extent (m)", yscale="log", ylim=(0.03, 8))
            panels[1].set(ylabel="standard deviation (m)", yscale="log", ylim=(0.004, 1.5))
            panels[1].set(xlabel="time (s)", xlim=(0, _SHOWN))
            show_plain_ticks(panels[0].yaxis, (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5))
            show_plain_ticks(panels[1].yaxis, (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1))
    return pictures


def seconds_until_small(run: Track) -> float:
    """From the start until the extent stays small in x and in y; nan when it does not."""
    is_large = np.any(run.extents >= SMALL, axis=1)
    first = int(np.max(np.flatnonzero(is_large), initial=-1)) + 1
    return float(seconds_from_start(run)[first]) if first < len(is_large) else np.nan


def seconds_from_start(run: Track) -> NDArray[np.float64]:
    """(S + 1,) of the cloud as it was set and after each scan; the first comes a period after the start."""
    return np.append(0.0, run.seconds + np.median(np.diff(run.seconds)))


def _last_half(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[len(values) // 2 :]
