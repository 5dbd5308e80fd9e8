"""How accurate the localizer is on simulated drives: every row of the documentation's table, measured."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.drives import (
    BETWEEN_KIDNAPPINGS,
    FAR,
    TRACKING_SPEED,
    changed_map_drive,
    racing_drive,
    tracking_drive,
)
from benchmarks.accuracy.kidnapping import join_as_kidnappings
from benchmarks.accuracy.localized_drive import LocalizedDrive, localize_drive
from benchmarks.accuracy.lookalikes import Lookalikes
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

MAPS = ("building", "track")
_SCANS_PER_SECOND = round(1.0 / UST_10LX.scan_time)
_DRIVE_SECONDS = 30.0
_LOST = 0.5
"""Metres off, or probability of being lost, from which on the car counts as lost."""
_RIGHT = 0.25
"""Metres off, up to which an estimate counts as right."""
_FIND_SECONDS, _NOTICE_SECONDS, _FIND_AGAIN_SECONDS = 3.0, 1.0, 3.0
"""Within which the start has to be found, a kidnapping noticed, and the car found again after one."""


@dataclass(frozen=True)
class TrackingFigures:
    """Errors of all scans of some drives, the start known."""

    drives: int
    scans: int
    mean_m: float
    percentile_95_m: float
    largest_m: float
    mean_deg: float
    share_inside_95: float
    """Of the errors, that lie inside the reported covariance's ellipsoid of 95 %."""
    scans_lost: int
    """With an error of half a metre or more."""
    false_alarms: int
    """How often the map was searched again, or the car reported as more likely lost than not."""


@dataclass(frozen=True)
class FindingFigures:
    """How often a place was found."""

    places: int
    lookalikes_left_out: int
    found: int
    noticed: int | None
    """Kidnapped only: how often it was noticed in time."""
    median_seconds: float
    """Until the estimate was right and stayed so."""

    @property
    def share_found(self) -> float:
        """Of the places."""
        return self.found / self.places


class AccuracyBenchmark:
    """Tries one configuration on the shipped maps."""

    def __init__(
        self,
        settings: LocalizationConfig,
        seeds: int,
        announce: Callable[[str], None],
        places_seconds: float = 600.0,
    ) -> None:
        """Places to be found are drawn from a drive of so many seconds."""
        self._settings = settings
        self._places_seconds = places_seconds
        self.seeds = seeds
        self._announce = announce
        self._grids = {name: load_map(shipped_map(name)) for name in MAPS}

    def tracking(self, map_name: str, noise: NoiseLevel, seconds: float) -> TrackingFigures:
        """At up to 3 m/s."""
        self._announce(f"Tracking: {map_name}, noise {noise.value}")
        return self._measured(map_name, lambda grid, seed: tracking_drive(grid, seed, seconds, noise))

    def racing(self, map_name: str, seconds: float) -> TrackingFigures:
        """At up to 7 m/s, with wheels that slip."""
        self._announce(f"Racing: {map_name}")
        return self._measured(map_name, lambda grid, seed: racing_drive(grid, seed, seconds))

    def changed_map(self, map_name: str, seconds: float) -> TrackingFigures:
        """Furniture was moved, and people stand around."""
        self._announce(f"Furniture moved, people about: {map_name}")
        return self._measured(map_name, lambda grid, seed: changed_map_drive(grid, seed, seconds))

    def long_drive(self, map_name: str, seconds: float) -> TrackingFigures:
        """One drive, for false alarms."""
        self._announce(f"Long drive: {map_name}")
        settings = SimulationConfig(
            noise=NoiseLevel.SLIGHT, seed=99, max_speed=TRACKING_SPEED, duration=seconds
        )
        drive = simulate_drive(self._grids[map_name], settings)
        return _tracking_figures([self._run(self._grids[map_name], drive, 0)])

    def global_start(self, places: dict[str, int]) -> FindingFigures:
        """Without a start pose, at places all over the maps."""
        results, left_out = [], 0
        for map_name, wanted in places.items():
            self._announce(f"Global start: {wanted} places, {map_name}")
            localizer = self._localizer(self._grids[map_name], 0)
            starts = self._distinct_drives(map_name, wanted, _FIND_SECONDS)
            for drive, lookalikes in starts:
                left_out += lookalikes
                localizer.scatter()
                results.append(localize_drive(localizer, drive))
        seconds = np.array([_right_after(result) for result in results])
        found = sum(bool(result.metres[-1] < _RIGHT) for result in results)
        return FindingFigures(len(results), left_out, found, None, float(np.median(seconds)))

    def kidnapped(self, map_name: str, times: int) -> FindingFigures:
        """Carried elsewhere between two scans, which nothing but the scans shows."""
        self._announce(f"Kidnapped {times} times: {map_name}")
        starts = list(self._distinct_drives(map_name, times + 1, BETWEEN_KIDNAPPINGS))
        drives = [drive for drive, _ in starts]
        whole, kidnappings = join_as_kidnappings(drives)
        localizer = self._localizer(self._grids[map_name], 0)
        localizer.set_pose(whole.truth.map_from_base[0])
        result = localize_drive(localizer, whole)
        found = noticed = 0
        seconds = []
        for first, last in zip(kidnappings, [*kidnappings[1:], len(whole.truth)], strict=True):
            soon = slice(first, first + round(_NOTICE_SECONDS * _SCANS_PER_SECOND))
            part = result.segment(first, last)
            noticed += any(
                estimate.lost_probability > _LOST or estimate.is_start for estimate in result.estimates[soon]
            )
            seconds.append(_right_after(part))
            found += seconds[-1] <= _FIND_AGAIN_SECONDS
        left_out = sum(lookalikes for _, lookalikes in starts)
        return FindingFigures(len(kidnappings), left_out, found, noticed, float(np.median(seconds)))

    def _measured(
        self, map_name: str, drive: Callable[[OccupancyGrid, int], SimulatedDrive]
    ) -> TrackingFigures:
        """Of the drive through a map by each seed."""
        grid = self._grids[map_name]
        return _tracking_figures([self._run(grid, drive(grid, seed), seed) for seed in range(self.seeds)])

    def _run(self, grid: OccupancyGrid, drive: SimulatedDrive, seed: int) -> LocalizedDrive:
        localizer = self._localizer(grid, seed)
        localizer.set_pose(drive.truth.map_from_base[0])
        return localize_drive(localizer, drive)

    def _localizer(self, grid: OccupancyGrid, seed: int) -> Localizer:
        return Localizer(grid, self._settings, np.random.default_rng(seed))

    def _distinct_drives(
        self, map_name: str, count: int, seconds: float
    ) -> Iterator[tuple[SimulatedDrive, int]]:
        """Drives of some seconds from random places, each with how many look-alikes were passed over for it.

        No two in a row are near each other.
        """
        grid, rng = self._grids[map_name], np.random.default_rng(17)
        lookalikes = Lookalikes(grid)
        settings = SimulationConfig(
            noise=NoiseLevel.SLIGHT, max_speed=TRACKING_SPEED, duration=self._places_seconds
        )
        long_drive = simulate_drive(grid, settings)
        length = round(seconds * _SCANS_PER_SECOND)
        before: Pose | None = None
        passed = 0
        while count > 0:
            first = int(rng.integers(len(long_drive.truth) - length))
            pose = long_drive.truth.map_from_base[first]
            if before is not None and np.hypot(*(pose - before)[:2]) < FAR:
                continue
            if lookalikes.has(pose, BASE_FROM_LASER, UST_10LX.bearings):
                passed += 1
                continue
            yield long_drive.segment(first, first + length), passed
            before = long_drive.truth.map_from_base[first + length - 1]
            count, passed = count - 1, 0


def measure_accuracy(
    benchmark: AccuracyBenchmark, minutes: float
) -> tuple[dict[str, TrackingFigures], dict[str, FindingFigures]]:
    """All rows: tracking, the last of them over so many minutes, and finding."""
    tracking = {
        f"{name}, up to 3 m/s, noise {noise.value}": benchmark.tracking(name, noise, _DRIVE_SECONDS)
        for name in MAPS
        for noise in NoiseLevel
    }
    for name in MAPS:
        tracking[f"{name}, up to 7 m/s, 25 % slip"] = benchmark.racing(name, _DRIVE_SECONDS)
    for name in MAPS:
        tracking[f"{name}, furniture moved, people"] = benchmark.changed_map(name, _DRIVE_SECONDS)
    tracking[f"{MAPS[0]}, {minutes:g} minutes"] = benchmark.long_drive(MAPS[0], 60.0 * minutes)
    places = 10 * benchmark.seeds
    finding = {"anywhere": benchmark.global_start(dict.fromkeys(MAPS, places))}
    for name in MAPS:
        finding[f"kidnapped, {name}"] = benchmark.kidnapped(name, places // len(MAPS))
    return tracking, finding


def _tracking_figures(runs: Sequence[LocalizedDrive]) -> TrackingFigures:
    metres = np.concatenate([result.metres for result in runs])
    alarms = 0
    for result in runs:
        alarmed = np.array([estimate.lost_probability > _LOST for estimate in result.estimates])
        alarms += int(np.count_nonzero(alarmed[1:] & ~alarmed[:-1]))
        alarms += sum(estimate.is_start for estimate in result.estimates[1:])
    return TrackingFigures(
        drives=len(runs),
        scans=len(metres),
        mean_m=float(metres.mean()),
        percentile_95_m=float(np.quantile(metres, 0.95)),
        largest_m=float(metres.max()),
        mean_deg=float(np.concatenate([result.degrees for result in runs]).mean()),
        share_inside_95=float(np.concatenate([result.is_inside for result in runs]).mean()),
        scans_lost=int(np.count_nonzero(metres >= _LOST)),
        false_alarms=alarms,
    )


def _right_after(result: LocalizedDrive) -> float:
    """Seconds after which the estimate was right and stayed so; inf when it was not in the end."""
    wrong = np.flatnonzero(result.metres >= _RIGHT)
    first_right = int(wrong[-1]) + 1 if len(wrong) else 0
    return first_right / _SCANS_PER_SECOND if first_right < len(result.metres) else np.inf
