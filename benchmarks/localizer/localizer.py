"""The localizer's speed, compared with its unavoidable memory loads and a plain filter.

Everything runs in one warmed-up process and, except for the checks of threads and cores, in one thread.
Measurements are interleaved, so that other work on the machine slows all of them. Times are medians of this
thread's processor time; ratios are medians of the ratios within a round.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import recordings_folder
from benchmarks.harness.table import Column, cells, transposed
from benchmarks.localizer.interleaved_timing import PARTS, InterleavedTiming
from benchmarks.localizer.measured_drive import MeasuredDrive
from benchmarks.localizer.other_thread import pace_of_other_thread
from benchmarks.localizer.second_core import time_second_core
from benchmarks.localizer.stopwatch import Stopwatch
from racecar.localization.config import LocalizationConfig
from racecar.localization.recovery.perception import Perception
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map


@dataclass(frozen=True)
class Workload:
    """The amount of work measured."""

    particles: int = 4000
    beams: int = 100
    spread_particles: int = 100_000
    rounds: int = 30
    """Each round measures everything once."""
    steps: int = 10
    """Steps of the drive per round."""
    warm_up_steps: int = 40
    surveys: int = 3
    searches: int = 10
    pace_rounds: int = 20
    pace_steps: int = 20

    @property
    def steps_in_all(self) -> int:
        """Number of steps after the cloud has converged."""
        return self.steps * (self.rounds + 1) + self.pace_steps * self.pace_rounds


FULL = Workload()


@dataclass(frozen=True)
class LocalizerFigures:
    """The figures on one map."""

    step_ms: Annotated[float, Column("full step (ms)", ".3f")]
    """Motion, sensor, resampling and estimate of one scan, and adding the odometry before it."""
    loads_ms: Annotated[float, Column("bare loads (ms)", ".3f")]
    """Bare loads of the likelihood field's codes that the sensor update of the cloud needs."""
    plain_step_ms: Annotated[float, Column("plain filter's step (ms)", ".3f")]
    step_beside_thread_ms: Annotated[float, Column("step beside a busy Python thread (ms)", ".3f")]
    """Whenever a kernel ends, Python lets that loop run for a few milliseconds before the step continues."""
    error_m: Annotated[float, Column("mean error, this filter (m)", ".3f")]
    """Mean distance to the truth, which shows that working filters were measured."""
    plain_error_m: Annotated[float, Column("mean error, plain filter (m)", ".3f")]
    resampled: Annotated[float, Column("steps that resampled", ".0%")]
    step_parts_ms: dict[str, float]
    """Each part measured separately on the current cloud; the rest is motion, weights and Python."""
    cloud_ns_per_particle: float
    spread_ns_per_particle: float
    loads_ratio: float
    """Ratio of the full step to the bare loads."""
    plain_ratio: float
    """Ratio of the plain filter to the full step."""
    spread_ratio: float
    """Ratio of the time per particle spread over the whole map to that in a narrow cloud."""
    survey_seconds: float
    """Wall time of the map's survey."""
    search_gain: float
    """Ratio of the time to search the whole map for a scan on one core to that on both."""
    other_thread_pace: float
    """Pace of a Python loop in another thread during updates, as a share of that while this thread spins."""


@dataclass(frozen=True)
class Check:
    """A figure and its limit."""

    figure: str
    """Name of a figure of `LocalizerFigures`."""
    bar: float
    is_upper: bool
    shape: str = ".2f"

    def holds(self, figures: LocalizerFigures) -> bool:
        """Whether the figure is within its limit."""
        value = getattr(figures, self.figure)
        return bool(value <= self.bar if self.is_upper else value >= self.bar)

    def cells(self, maps: Mapping[str, LocalizerFigures]) -> dict[str, str]:
        """The figure on each map."""
        missed = [name for name, figures in maps.items() if not self.holds(figures)]
        return {
            "bar": f"{'≤' if self.is_upper else '≥'} {self.bar:g}",
            **{name: f"{getattr(figures, self.figure):{self.shape}}" for name, figures in maps.items()},
            "holds": f"no: {', '.join(missed)}" if missed else "yes",
        }


CHECKS = {
    "full step / bare loads": Check("loads_ratio", 2.5, True),
    "plain filter / full step": Check("plain_ratio", 40.0, False, ".1f"),
    "a spread particle / one of a cloud": Check("spread_ratio", 3.0, True),
    "survey of the map (s)": Check("survey_seconds", 2.0, True),
    "search of the map, one core / both": Check("search_gain", 1.6, False),
    "pace of another thread": Check("other_thread_pace", 0.8, False),
}


def localizer(bench: Bench) -> None:
    """Time the localizer with 4000 particles and 100 beams, beside plain memory loads and a plain filter.

    On the shipped building and, where there are recordings, the basement's map.

    Example: python -m benchmarks localizer --json localizer.json
    """
    measure = partial(time_localizer, workload=FULL, settings=bench.settings.localization, seed=bench.seed)
    maps = bench.each("maps", benchmark_maps(), measure)
    bench.table("Speed of the localizer", {name: check.cells(maps) for name, check in CHECKS.items()})
    parts = {
        name: {f"of the step: {part} (ms)": f"{ms:.3f}" for part, ms in figures.step_parts_ms.items()}
        for name, figures in maps.items()
    }
    bench.table("Behind it", transposed({name: {**cells(maps[name]), **parts[name]} for name in maps}))


def benchmark_maps() -> dict[str, OccupancyGrid]:
    """The shipped building and, if there are recordings, the basement's map, by name."""
    maps = {"building": load_map(shipped_map("building"))}
    basement = recordings_folder() / "racecar" / "maps" / "stata_basement.yaml"
    if basement.exists():
        maps[basement.stem] = load_map(basement)
    return maps


def time_localizer(
    grid: OccupancyGrid, workload: Workload, settings: LocalizationConfig, seed: int
) -> LocalizerFigures:
    """Measure on a simulated drive through a map.

    Raises UserError if the map has no room for the car.
    """
    counts = {"particles": workload.particles, "fewest_particles": workload.particles}
    config = settings.model_copy(update={**counts, "beams": workload.beams})
    watch = Stopwatch()
    perception = Perception(grid)
    surveying = time_second_core(lambda: Perception(grid), workload.surveys)
    drive = MeasuredDrive(grid, config, workload.steps_in_all, workload.warm_up_steps, seed)
    rng = np.random.default_rng([seed, 1])
    places, points = perception.places, drive.points
    searching = time_second_core(lambda: places.find(points, config.particles, rng), workload.searches)
    turns = InterleavedTiming(drive, perception, workload.spread_particles, rng)
    turns.take(workload.steps, Stopwatch())  # compiles the measured code
    for _ in range(workload.rounds):
        watch.begin_round()
        turns.take(workload.steps, watch)
    step_ms = watch.milliseconds("step")
    pace, beside_ms = pace_of_other_thread(drive, workload.pace_rounds, workload.pace_steps, 1e-3 * step_ms)
    parts = {name: watch.milliseconds(name) for name in PARTS}
    share = workload.particles / workload.spread_particles
    return LocalizerFigures(
        step_ms=step_ms,
        step_parts_ms={**parts, "rest": step_ms - sum(parts.values())},
        resampled=float(np.mean(turns.resampled)),
        loads_ms=watch.milliseconds("loads"),
        plain_step_ms=watch.milliseconds("plain step"),
        error_m=float(np.mean(turns.errors)),
        plain_error_m=float(np.mean(turns.plain_errors)),
        cloud_ns_per_particle=1e6 * watch.milliseconds("sensor") / workload.particles,
        spread_ns_per_particle=1e6 * watch.milliseconds("spread sensor") / workload.spread_particles,
        survey_seconds=surveying.seconds,
        search_gain=searching.gain,
        other_thread_pace=pace,
        step_beside_thread_ms=beside_ms,
        loads_ratio=watch.ratio("step", to="loads"),
        plain_ratio=watch.ratio("plain step", to="step"),
        spread_ratio=share * watch.ratio("spread sensor", to="sensor"),
    )
