"""The two filters that the experiments compare, and runs of them over seeds."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.experiments.figure_style import COURSE_NAME, OURS_NAME
from racecar.pipelines.experiments.tracking import Filter
from racecar.pipelines.runs.evaluation.course_filter import CourseFilter, CourseSettings
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import SimulationConfig

_K = TypeVar("_K")
_R = TypeVar("_R")
FilterSettings: TypeAlias = LocalizationConfig | CourseSettings

_EVERY = 2
"""Of 40 scans a second, 20 are used: the rate that the course asks for."""


def both_filters(settings: LocalizationConfig) -> dict[str, FilterSettings]:
    """By name."""
    return {OURS_NAME: settings, COURSE_NAME: CourseSettings()}


def with_motion_noise(settings: LocalizationConfig, noise: float) -> LocalizationConfig:
    """All four of the motion model's noises set to one value, and no slip beside them."""
    kinds = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
    return settings.model_copy(update={**dict.fromkeys(kinds, noise), "slip": 0.0})


def start_filter(
    settings: FilterSettings,
    grid: OccupancyGrid,
    map_from_base: Pose,
    deviations: tuple[float, float, float],
    rng: np.random.Generator,
) -> Filter:
    """The filter that has these settings, its particles spread normally about a pose (3,)."""
    filter_: Localizer | CourseFilter
    if isinstance(settings, CourseSettings):
        filter_ = CourseFilter(grid, settings, rng)
    else:
        filter_ = Localizer(grid, settings, rng)
    filter_.set_pose(map_from_base, np.diag(np.square(deviations)))
    return filter_


def sweep(
    parallel: ParallelRuns,
    what: str,
    measure: Callable[..., _R],
    cases: Mapping[_K, tuple[Any, ...]],
    seeds: int,
) -> dict[_K, list[_R]]:
    """``measure(*case, seed)`` of each case and each of so many seeds, in parallel."""
    arguments = [(*case, seed) for case in cases.values() for seed in range(seeds)]
    done = iter(parallel.run(what, measure, arguments))
    return {name: [next(done) for _ in range(seeds)] for name in cases}


@lru_cache(maxsize=4)
def simulated_drive(map_name: str, config: SimulationConfig) -> SimulatedDrive:
    """A drive through a shipped map; a process that is asked again has it at hand."""
    return simulate_drive(load_map(Path(map_name)), config, every=_EVERY)
