"""The two filters compared by the experiments, runs of them over drives, and sweeps over cases and seeds."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.bags.replay import ScanConsumer, replay
from racecar.pipelines.experiments.page import COURSE_NAME, OURS_NAME
from racecar.pipelines.runs.evaluation.course_filter import CourseEstimate, CourseFilter, CourseSettings
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_K = TypeVar("_K")
FilterSettings: TypeAlias = LocalizationConfig | CourseSettings
Filter: TypeAlias = Localizer | CourseFilter
Estimate: TypeAlias = PoseEstimate | CourseEstimate
Measured: TypeAlias = Mapping[str, NDArray[np.float64]]
"""Results for a case, by name: (seeds, ...)."""

_EVERY = 2
"""20 of 40 scans a second are used, the rate required by the course."""


def both_filters(settings: LocalizationConfig) -> dict[str, FilterSettings]:
    """Both filters by name."""
    return {OURS_NAME: settings, COURSE_NAME: CourseSettings()}


def with_motion_noise(settings: LocalizationConfig, noise: float) -> LocalizationConfig:
    """The settings with all four noises of the motion model set to one value, and without slip."""
    kinds = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
    return settings.model_copy(update={**dict.fromkeys(kinds, noise), "slip": 0.0})


def with_particles(settings: LocalizationConfig, particles: int, **others: Any) -> LocalizationConfig:
    """The settings with a fixed number of particles, and other changes."""
    counts = ("particles", "fewest_particles", "scattered_particles")
    return settings.model_copy(update={**dict.fromkeys(counts, particles), **others})


def start_filter(
    settings: FilterSettings,
    grid: OccupancyGrid,
    map_from_base: Pose,
    deviations: tuple[float, float, float],
    rng: np.random.Generator,
) -> Filter:
    """A filter with these settings, its particles drawn from a normal distribution about a pose (3,)."""
    filter_: Filter
    if isinstance(settings, CourseSettings):
        filter_ = CourseFilter(grid, settings, rng)
    else:
        filter_ = Localizer(grid, settings, rng)
    filter_.set_pose(map_from_base, np.diag(np.square(deviations)))
    return filter_


@dataclass(frozen=True, eq=False)
class Track:
    """A filter's estimates, one entry per scan."""

    stamps: NDArray[np.int64]
    """(S,) nanoseconds."""
    map_from_base: Pose
    """(S, 3)"""
    extents: NDArray[np.float64]
    """(S, 2) metres between the extreme particles, in x and in y."""
    deviations: NDArray[np.float64]
    """(S,) standard deviation in metres of the particles' positions, both axes combined."""
    effective_sizes: NDArray[np.float64]
    """(S,) effective sample sizes."""
    update_seconds: NDArray[np.float64]
    """(S,) wall time."""

    @property
    def seconds(self) -> NDArray[np.float64]:
        """(S,) since the first scan."""
        elapsed: NDArray[np.float64] = (self.stamps - self.stamps[0]) * 1e-9
        return elapsed


def track(
    filter_: Filter,
    messages: Iterable[Measurement],
    watch: Callable[[Scan, Estimate], None] = lambda scan, estimate: None,
) -> Track:
    """Run a filter on messages that include scans; ``watch`` also receives every scan and its estimate."""
    consumer: ScanConsumer[Estimate] = filter_
    rows = []
    for replayed in replay(messages, consumer):
        estimate = replayed.answer
        size = estimate.effective_sample_size
        row = replayed.scan.stamp, estimate.map_from_base, *cloud_spread(filter_), size, replayed.seconds
        rows.append(row)
        watch(replayed.scan, estimate)
    return Track(*map(np.array, zip(*rows, strict=True)))


def cloud_spread(filter_: Filter) -> tuple[NDArray[np.float64], float]:
    """The extent (2,) of the particles and the standard deviation of their positions, metres."""
    particles, weights = filter_.particles()
    places = particles[:, :2]
    variance = weights @ np.sum((places - weights @ places) ** 2, axis=1)
    return np.ptp(places, axis=0), float(np.sqrt(variance))


def place_errors(estimated: Pose, true: Pose) -> NDArray[np.float64]:
    """(S,) metres between poses (S, 3)."""
    errors: NDArray[np.float64] = np.hypot(*(estimated - true)[:, :2].T)
    return errors


def heading_errors(estimated: Pose, true: Pose) -> NDArray[np.float64]:
    """(S,) degrees between poses (S, 3), unsigned."""
    return np.degrees(np.abs(wrap_angle(estimated[:, 2] - true[:, 2])))


def sweep(
    parallel: ParallelRuns,
    what: str,
    measure: Callable[..., Mapping[str, Any]],
    cases: Mapping[_K, tuple[Any, ...]],
    seeds: int,
) -> dict[_K, Measured]:
    """Results of ``measure(*case, seed)`` for each case and each of ``seeds`` seeds, in parallel."""
    arguments = [(*case, seed) for case in cases.values() for seed in range(seeds)]
    done = iter(parallel.run(what, measure, arguments))
    return {name: over_seeds([next(done) for _ in range(seeds)]) for name in cases}


def over_seeds(runs: list[Mapping[str, Any]]) -> Measured:
    """Stack each result over the runs."""
    return {figure: np.array([run[figure] for run in runs]) for figure in runs[0]}


@lru_cache(maxsize=4)
def simulated_drive(map_name: str, config: SimulationConfig) -> SimulatedDrive:
    """A drive through a shipped map, cached per process."""
    return simulate_drive(load_map(Path(map_name)), config, every=_EVERY)
