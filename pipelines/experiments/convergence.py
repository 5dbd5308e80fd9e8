"""How fast a cloud of 0.5 m collapses about the car, and how wide it stays."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.measurement import Measurement
from racecar.pipelines.evaluation.course_filter import CourseSettings
from racecar.pipelines.experiments.figure_style import (
    COURSE_NAME,
    OURS_NAME,
    Picture,
    drawing,
    finish,
    legend_below,
    show_plain_ticks,
)
from racecar.pipelines.experiments.filters import COLORS, start_filter
from racecar.pipelines.experiments.lab_room import CircleDrive, draw_lab_room
from racecar.pipelines.experiments.recording import Recording, first_seconds, known_start
from racecar.pipelines.experiments.result import ExperimentSettings, FigureTable
from racecar.pipelines.experiments.tracking import Track, track
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_SPREAD = (0.5, 0.5, 0.25)
"""Standard deviations of the start: metres, metres, radians."""
_SECONDS, _SHOWN = 10.0, 3.0
"""How long a drive is, and how much of it the figures show."""
SMALL = 0.5
"""Metres from the first to the last particle, in x and in y, that count as small."""


@dataclass(frozen=True, eq=False)
class Convergence:
    """Tracks by where they were driven and by filter, one for each seed."""

    tracks: Mapping[str, Mapping[str, list[Track]]]
    title: str = "Convergence: from a spread of 0.5 m"

    def seconds_until_small(self, place: str, name: str) -> NDArray[np.float64]:
        """(seeds,) until the extent of the cloud stays small in x and in y; nan when it does not."""
        return np.array([seconds_until_small(run) for run in self.tracks[place][name]])

    def extents_afterwards(self, place: str, name: str) -> NDArray[np.float64]:
        """(seeds,) metres: the mean extent, of x and y, in the last half."""
        return np.array([run.extents[len(run.extents) // 2 :].mean() for run in self.tracks[place][name]])

    def deviations_afterwards(self, place: str, name: str) -> NDArray[np.float64]:
        """(seeds,) metres: the mean standard deviation of the particles' place in the last half."""
        return np.array(
            [run.deviations[len(run.deviations) // 2 :].mean() for run in self.tracks[place][name]]
        )

    def text(self) -> list[str]:
        seeds = len(next(iter(self.tracks.values()))[OURS_NAME])
        return [
            f"The particles start spread normally by {_SPREAD[0]:g} m in x and y and {_SPREAD[2]:g} rad "
            f"about a pose that is itself off by a draw from the same spread; {seeds} seeds. The extent of "
            "the cloud is its last particle less its first, in x and in y. It is small when both stay "
            f"below {SMALL:g} m until the end.",
            "The extent is a hard measure: one particle out of thousands decides it. This library's filter "
            "always tries a few particles away from the cloud, to find the car again when it is lost, so "
            "the standard deviation is given as well.",
        ]

    def tables(self) -> list[FigureTable]:
        columns = (
            *("drive", "filter", "seeds", "time until small (s)", "not small"),
            *("extent afterwards (m)", "standard deviation afterwards (m)"),
        )
        rows = []
        for place, by_name in self.tracks.items():
            for name, runs in by_name.items():
                seconds = self.seconds_until_small(place, name)
                rows.append(
                    (
                        *(place, name, f"{len(runs)}", _plus_minus(seconds, 2), f"{np.isnan(seconds).sum()}"),
                        _plus_minus(self.extents_afterwards(place, name), 3),
                        _plus_minus(self.deviations_afterwards(place, name), 4),
                    )
                )
        return [FigureTable("Mean ± standard deviation over the seeds", columns, rows)]

    def figures(self) -> dict[str, Any]:
        return {
            place: {
                name: {
                    "seconds_until_small": self.seconds_until_small(place, name),
                    "extent_afterwards_m": self.extents_afterwards(place, name),
                    "deviation_afterwards_m": self.deviations_afterwards(place, name),
                }
                for name in by_name
            }
            for place, by_name in self.tracks.items()
        }

    def pictures(self) -> list[Picture]:
        suffixes = ["", *(f"-{number}" for number in range(2, len(self.tracks) + 1))]
        return [self._over_time(place, suffix) for place, suffix in zip(self.tracks, suffixes, strict=True)]

    def _over_time(self, place: str, suffix: str) -> Picture:
        with drawing(98) as figure:
            panels = figure.subplots(2, 1, sharex=True)
            for name, runs in self.tracks[place].items():
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
            legend_below(figure, columns=3)
            return finish(
                figure,
                f"convergence{suffix}",
                f"The cloud over time, {place}: above its extent, the larger of x and y; below its standard "
                "deviation. Lines are the median over the seeds, bands hold eight seeds of ten.",
            )


def convergence(settings: ExperimentSettings, parallel: ParallelRuns) -> Convergence:
    """Both filters in the lab room, 20 seeds (3 when quick), and on a recording when there is one."""
    variants: dict[str, LocalizationConfig | CourseSettings] = {
        OURS_NAME: settings.localization,
        COURSE_NAME: CourseSettings(),
    }
    seeds = range(3 if settings.quick else 20)
    places: dict[str, Recording | None] = {"lab room": None}
    if settings.recording is not None:
        places[settings.recording.title] = settings.recording
    arguments = [
        (variant, place, settings.seed, index)
        for place in places.values()
        for variant in variants.values()
        for index in seeds
    ]
    done = iter(parallel.run("Convergence", converge, arguments))
    return Convergence({place: {name: [next(done) for _ in seeds] for name in variants} for place in places})


def converge(
    variant: LocalizationConfig | CourseSettings, recording: Recording | None, seed: int, index: int
) -> Track:
    """One filter from one start; the same seed and index start alike in both."""
    rng = np.random.default_rng([seed, index, 3])
    grid, start, messages = _in_lab_room(rng) if recording is None else _in_recording(recording)
    off = rng.standard_normal(3) * _SPREAD
    filter_ = start_filter(variant, grid, start + off, _SPREAD, np.random.default_rng([seed, index, 4]))
    return track(filter_, messages, with_start=True)


def _in_lab_room(rng: np.random.Generator) -> tuple[OccupancyGrid, Pose, list[Measurement]]:
    drive = CircleDrive(draw_lab_room(), _SECONDS, np.zeros(3), np.inf)
    return drive.grid, np.zeros(3), list(drive.messages(rng))


def _in_recording(recording: Recording) -> tuple[OccupancyGrid, Pose, list[Measurement]]:
    messages = list(first_seconds(recording.messages(), _SECONDS))
    return recording.load_map(), known_start(recording), messages


def seconds_until_small(run: Track) -> float:
    """From the start until the extent stays small in x and in y; nan when it does not."""
    is_large = np.any(run.extents >= SMALL, axis=1)
    first = int(np.max(np.flatnonzero(is_large), initial=-1)) + 1
    return float(seconds_from_start(run)[first]) if first < len(is_large) else np.nan


def seconds_from_start(run: Track) -> NDArray[np.float64]:
    """(S + 1,) of the cloud as it was set and after each scan; the first comes a period after the start."""
    seconds = run.seconds
    return np.append(0.0, seconds + np.median(np.diff(seconds)))


def _plus_minus(values: NDArray[np.float64], digits: int) -> str:
    known = values[np.isfinite(values)]
    return f"{known.mean():.{digits}f} ± {known.std():.{digits}f}" if len(known) else "–"
