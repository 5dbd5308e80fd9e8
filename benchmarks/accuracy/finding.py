"""How often the localizer finds an unknown pose: at the start, or after a kidnapping."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from benchmarks.accuracy.drives import BETWEEN_KIDNAPPINGS, FAR, MAPS, grid_of, places_drive
from benchmarks.accuracy.kidnapping import join_as_kidnappings
from benchmarks.accuracy.localized_drive import LOST, LocalizedDrive, localize_drive
from benchmarks.accuracy.lookalikes import Lookalikes
from benchmarks.harness.table import Column
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive

_SCANS_PER_SECOND = round(1.0 / UST_10LX.scan_time)
_RIGHT = 0.25
"""Maximum error in metres of a correct estimate."""
_FIND_SECONDS, _NOTICE_SECONDS, _FIND_AGAIN_SECONDS = 3.0, 1.0, 3.0
"""Limits in seconds to find the start, to notice a kidnapping, and to find the car again after one."""


@dataclass(frozen=True)
class FindingCase:
    """Places to find."""

    places: Mapping[str, int]
    """Number of places by map."""
    is_kidnapped: bool
    """The car was tracked before, on the only map; otherwise it starts there."""


@dataclass(frozen=True)
class FindingFigures:
    """How often a place was found."""

    places: Annotated[int, Column("places")]
    lookalikes_left_out: Annotated[int, Column("look-alikes left out")]
    share_noticed: Annotated[float | None, Column(f"noticed within {_NOTICE_SECONDS:g} s", ".1%")]
    """Kidnapped only: the share noticed in time."""
    share_found: Annotated[float, Column("found", ".1%")]
    median_seconds: Annotated[float, Column("median (s)", ".2f")]
    """Until the estimate was correct and stayed so."""


def finding_cases(seeds: int) -> dict[str, FindingCase]:
    """Ten places per seed on each map, and half as many kidnappings."""
    places = 10 * seeds
    return {
        "anywhere": FindingCase(dict.fromkeys(MAPS, places), is_kidnapped=False),
        **{
            f"kidnapped, {name}": FindingCase({name: places // len(MAPS)}, is_kidnapped=True) for name in MAPS
        },
    }


def find(case: FindingCase, settings: LocalizationConfig) -> FindingFigures:
    """Find all places."""
    if case.is_kidnapped:
        ((map_name, times),) = case.places.items()
        return _kidnapped(map_name, times, settings)
    return _anywhere(case.places, settings)


def _anywhere(places: Mapping[str, int], settings: LocalizationConfig) -> FindingFigures:
    """Places all over the maps without a start pose."""
    results, left_out = [], 0
    for map_name, wanted in places.items():
        localizer = _localizer(map_name, settings)
        for drive, lookalikes in _distinct_drives(map_name, wanted, _FIND_SECONDS):
            left_out += lookalikes
            localizer.scatter()
            results.append(localize_drive(localizer, drive))
    is_found = [bool(result.metres[-1] < _RIGHT) for result in results]
    seconds = [_right_after(result) for result in results]
    return FindingFigures(len(results), left_out, None, _share(is_found), float(np.median(seconds)))


def _kidnapped(map_name: str, times: int, settings: LocalizationConfig) -> FindingFigures:
    """Kidnappings between two scans, visible only in the scans."""
    starts = list(_distinct_drives(map_name, times + 1, BETWEEN_KIDNAPPINGS))
    whole, kidnappings = join_as_kidnappings([drive for drive, _ in starts])
    localizer = _localizer(map_name, settings)
    localizer.set_pose(whole.truth.map_from_base[0])
    result = localize_drive(localizer, whole)
    soon = round(_NOTICE_SECONDS * _SCANS_PER_SECOND)
    is_noticed = [
        any(each.lost_probability > LOST or each.is_start for each in result.estimates[first : first + soon])
        for first in kidnappings
    ]
    ends = [*kidnappings[1:], len(whole.truth)]
    parts = [result.segment(first, last) for first, last in zip(kidnappings, ends, strict=True)]
    seconds = [_right_after(part) for part in parts]
    is_found = [each <= _FIND_AGAIN_SECONDS for each in seconds]
    left_out = sum(lookalikes for _, lookalikes in starts)
    return FindingFigures(
        len(parts), left_out, _share(is_noticed), _share(is_found), float(np.median(seconds))
    )


def _localizer(map_name: str, settings: LocalizationConfig) -> Localizer:
    return Localizer(grid_of(map_name), settings, np.random.default_rng(0))


def _distinct_drives(map_name: str, count: int, seconds: float) -> Iterator[tuple[SimulatedDrive, int]]:
    """Drives of some seconds from random places, each with the number of look-alikes skipped before it.

    No two consecutive ones are near each other.
    """
    grid, rng = grid_of(map_name), np.random.default_rng(17)
    lookalikes = Lookalikes(grid)
    whole = places_drive(grid)
    length = round(seconds * _SCANS_PER_SECOND)
    before: Pose | None = None
    passed = 0
    while count > 0:
        first = int(rng.integers(len(whole.truth) - length))
        pose = whole.truth.map_from_base[first]
        if before is not None and np.hypot(*(pose - before)[:2]) < FAR:
            continue
        if lookalikes.has(pose, BASE_FROM_LASER, UST_10LX.bearings):
            passed += 1
            continue
        yield _part(whole, first, first + length), passed
        before = whole.truth.map_from_base[first + length - 1]
        count, passed = count - 1, 0


def _part(drive: SimulatedDrive, first: int, last: int) -> SimulatedDrive:
    """The drive from scan ``first`` up to, but not including, scan ``last``."""
    start, end = drive.truth.stamps[[first, last]]
    messages = [message for message in drive.messages if start <= message.stamp < end]
    stamps, poses = drive.truth.stamps[first:last], drive.truth.map_from_base[first:last]
    return SimulatedDrive(drive.grid, messages, Trajectory(stamps, poses))


def _right_after(result: LocalizedDrive) -> float:
    """Seconds until the estimate was correct and stayed so; inf if it is wrong at the end."""
    wrong = np.flatnonzero(result.metres >= _RIGHT)
    first_right = int(wrong[-1]) + 1 if len(wrong) else 0
    return first_right / _SCANS_PER_SECOND if first_right < len(result.metres) else np.inf


def _share(are: list[bool]) -> float:
    return float(np.mean(are))
