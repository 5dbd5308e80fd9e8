"""How fast the localizer is, beside the memory loads it cannot do without and a filter written plainly.

All in one process and, but for the checks of threads and cores, in one thread, warmed up. What is compared
takes turns, so that other work on the machine slows both; times are medians of this thread's time of the
processor, and ratios of times medians of those within a round.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.range_table.range_table import RangeTable, affordable_cells, build_range_table
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beams import Beams
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.benchmarks.localizer.interleaved_timing import PARTS, InterleavedTiming
from racecar.pipelines.benchmarks.localizer.measured_drive import MeasuredDrive
from racecar.pipelines.benchmarks.localizer.other_thread import pace_of_other_thread
from racecar.pipelines.benchmarks.localizer.second_core import time_second_core
from racecar.pipelines.benchmarks.localizer.stopwatch import Stopwatch
from racecar.pipelines.benchmarks.recordings_folder import recordings_folder

_OFF = 0.15
"""Metres: three cells of the shipped maps."""
_RAY_PLACES = 4000
"""Poses from which the table's rays are compared with exact ones."""
_WIDE_DEVIATIONS = np.array([0.5, 0.5, 0.25])
"""Metres and radians, of a cloud that is as wide as when the car has just been found."""


@dataclass(frozen=True)
class Workload:
    """How much is measured."""

    particles: int = 4000
    beams: int = 100
    spread_particles: int = 100_000
    rounds: int = 30
    """In each, everything takes its turn."""
    steps: int = 10
    """Of the drive in each round."""
    warm_up_steps: int = 40
    table_builds: int = 3
    searches: int = 10
    pace_rounds: int = 20
    pace_steps: int = 20
    wide_clouds: int = 10

    @property
    def steps_in_all(self) -> int:
        """Once the cloud is narrow."""
        return self.steps * (self.rounds + 1) + self.pace_steps * self.pace_rounds + self.wide_clouds


FULL = Workload()


@dataclass(frozen=True)
class LocalizerFigures:
    """The figures on one map."""

    step_ms: float
    """Motion, sensor, resampling and estimate of one scan, and taking in the odometry before it."""
    step_parts_ms: dict[str, float]
    """Each measured alone on the cloud of the moment; the rest is motion, weights and Python."""
    resampled: float
    """Share of the steps that did."""
    loads_ms: float
    """Bare loads from those rows of the table where the cloud is."""
    scattered_loads_ms: float
    """As many from anywhere in the table."""
    plain_step_ms: float
    error_m: float
    """Mean distance to the truth: it is filters at work that were measured."""
    plain_error_m: float
    cloud_ns_per_particle: float
    spread_ns_per_particle: float
    table_seconds: float
    """By the clock, on both cores."""
    table_gain: float
    """The time that it takes on one core over that on both."""
    search_gain: float
    """The same of the search of the whole map for a scan."""
    table_megabytes: float
    rays_off: float
    """Share of the table's rays that differ from exact ones by more than 0.15 m."""
    log_weight_correlation: float
    """With weights from exact rays, the lowest over some scans, on a cloud of 0.5 m and 0.25 rad."""
    other_thread_pace: float
    """Of a Python loop in another thread during updates, as a share of its pace while this thread spins."""
    step_beside_thread_ms: float
    """Whenever a kernel ends, Python lets that loop run on for some milliseconds before the step goes on."""
    loads_ratio: float
    """The full step over the bare loads."""
    plain_ratio: float
    """The filter written plainly over the full step."""
    spread_ratio: float
    """Time per particle spread over the whole map over that in a narrow cloud."""


def benchmark_maps() -> dict[str, OccupancyGrid]:
    """The shipped building and, where there are recordings, the basement's map, by name."""
    maps = {"building": load_map(shipped_map("building"))}
    basement = recordings_folder() / "racecar" / "maps" / "stata_basement.yaml"
    if basement.exists():
        maps[basement.stem] = load_map(basement)
    return maps


def measure_localizer(grid: OccupancyGrid, workload: Workload, seed: int) -> LocalizerFigures:
    """Measure on a simulated drive through a map.

    Raises UserError when the car finds no room in it or it is too large for a range table.
    """
    config = LocalizationConfig(
        particles=workload.particles, fewest_particles=workload.particles, beams=workload.beams
    )
    watch = Stopwatch()
    free_space, table = _build_table(grid, config)
    building = time_second_core(lambda: _build_table(grid, config), workload.table_builds)
    drive = MeasuredDrive(grid, config, workload.steps_in_all, workload.warm_up_steps, seed)
    rng = np.random.default_rng([seed, 1])
    model = BeamModel(free_space, table, config.beam_model, config.squash)
    places = PlaceSearch(free_space, table, config.place_search)
    beams = drive.beams
    searching = time_second_core(
        lambda: places.find(beams, config.squash, config.particles, rng), workload.searches
    )
    turns = InterleavedTiming(drive, model, free_space, table, workload.spread_particles, rng)
    turns.take(workload.steps, Stopwatch())  # compiles what is compared
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
        scattered_loads_ms=watch.milliseconds("scattered loads"),
        plain_step_ms=watch.milliseconds("plain step"),
        error_m=float(np.mean(turns.errors)),
        plain_error_m=float(np.mean(turns.plain_errors)),
        cloud_ns_per_particle=1e6 * watch.milliseconds("sensor") / workload.particles,
        spread_ns_per_particle=1e6 * watch.milliseconds("spread sensor") / workload.spread_particles,
        table_seconds=building.seconds,
        table_gain=building.gain,
        search_gain=searching.gain,
        table_megabytes=1e-6 * (table.ranges.nbytes + table.cell_index.nbytes),
        rays_off=rays_off(free_space, table, drive.beams.bearings, config, rng),
        log_weight_correlation=_log_weight_correlation(drive, free_space, table, workload, rng),
        other_thread_pace=pace,
        step_beside_thread_ms=beside_ms,
        loads_ratio=watch.ratio("step", to="loads"),
        plain_ratio=watch.ratio("plain step", to="step"),
        spread_ratio=share * watch.ratio("spread sensor", to="sensor"),
    )


def rays_off(
    free_space: FreeSpace,
    table: RangeTable,
    bearings: NDArray[np.float64],
    config: LocalizationConfig,
    rng: np.random.Generator,
) -> float:
    """Share of the rays off by over 0.15 m, at bearings (B,) from anywhere on the map, facing any way.

    Rays longer than the longest range of the table count as that long.
    """
    grid, reach = free_space.grid, table.codes.longest_range
    model = BeamModel(free_space, table, config.beam_model, config.squash)
    off = []
    for pose in free_space.draw_poses(_RAY_PLACES, rng):
        exact = cast_ray_fan(grid, pose[None], bearings, reach)[0]
        expected = model.expected_ranges(pose[None], Beams(bearings, exact, IDENTITY, reach))[0]
        off.append(np.abs(expected - np.minimum(exact, reach)) > _OFF)
    return float(np.mean(off))


def _log_weight_correlation(
    drive: MeasuredDrive,
    free_space: FreeSpace,
    table: RangeTable,
    workload: Workload,
    rng: np.random.Generator,
) -> float:
    """The lowest of some scans, over those particles of a wide cloud whose laser is where it can be."""
    config = drive.config
    model = BeamModel(free_space, table, config.beam_model, config.squash)
    exact_model = BeamModel(free_space, table.codes, config.beam_model, config.squash)
    correlations = []
    for _ in range(workload.wide_clouds):
        step, beams = drive.next_step(), drive.beams
        cloud = step.map_from_base + _WIDE_DEVIATIONS * rng.standard_normal((workload.particles, 3))
        cloud = cloud[free_space.contains(compose(cloud, step.scan.base_from_laser)[:, :2])]
        log_weights = model.log_likelihood(cloud, beams)
        exact = exact_model.log_likelihood(cloud, beams)
        correlations.append(float(np.corrcoef(log_weights, exact)[0, 1]))
    return min(correlations)


def _build_table(grid: OccupancyGrid, config: LocalizationConfig) -> tuple[FreeSpace, RangeTable]:
    """As the localizer does."""
    affordable = affordable_cells(config.table_megabytes, config.range_table)
    free_space = find_free_space(grid, affordable, config.free_space)
    table = build_range_table(free_space, config.table_megabytes, config.range_table)
    if not isinstance(table, RangeTable):
        raise UserError("The map is too large for a range table, so there is no speed to measure.")
    return free_space, table
