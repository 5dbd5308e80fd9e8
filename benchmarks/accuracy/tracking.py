"""The localizer's error while it knows where the car is."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from benchmarks.accuracy.drives import (
    MAPS,
    Simulate,
    changed_map_drive,
    grid_of,
    long_drive,
    racing_drive,
    tracking_drive,
)
from benchmarks.accuracy.localized_drive import LOST, LocalizedDrive, localize_drive
from benchmarks.harness.table import Column
from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.pipelines.simulation.simulator_config import NoiseLevel

_DRIVE_SECONDS = 30.0


@dataclass(frozen=True)
class TrackingCase:
    """Drives of one kind through a map, each from a known start."""

    map: str
    simulate: Simulate
    seconds: float
    seeds: Sequence[int]


@dataclass(frozen=True)
class TrackingFigures:
    """Errors of all scans of several drives."""

    drives: Annotated[int, Column("drives")]
    scans: Annotated[int, Column("scans")]
    mean_m: Annotated[float, Column("mean (m)", ".4f")]
    percentile_95_m: Annotated[float, Column("95 % (m)", ".3f")]
    largest_m: Annotated[float, Column("largest (m)", ".3f")]
    mean_deg: Annotated[float, Column("mean (°)", ".3f")]
    share_inside_95: Annotated[float, Column("inside the covariance's 95 %", ".1%")]
    """Share of the errors inside the 95 % ellipsoid of the reported covariance."""
    scans_lost: Annotated[int, Column("scans lost")]
    """Scans with an error of half a metre or more."""
    false_alarms: Annotated[int, Column("false alarms")]
    """Number of times that the map was searched again, or the car reported as more likely lost than not."""


def tracking_cases(seeds: Sequence[int], minutes: float) -> dict[str, TrackingCase]:
    """All cases; the last is one drive of this many minutes."""
    kinds: dict[str, Simulate] = {
        **{f"up to 3 m/s, noise {noise.value}": partial(tracking_drive, noise=noise) for noise in NoiseLevel},
        "up to 7 m/s, 25 % slip": racing_drive,
        "furniture moved, people": changed_map_drive,
    }
    return {
        **{
            f"{name}, {kind}": TrackingCase(name, simulate, _DRIVE_SECONDS, seeds)
            for kind, simulate in kinds.items()
            for name in MAPS
        },
        f"building, {minutes:g} minutes": TrackingCase("building", long_drive, 60.0 * minutes, seeds[:1]),
    }


def track(case: TrackingCase, settings: LocalizationConfig) -> TrackingFigures:
    """Localize the drive of each seed."""
    grid = grid_of(case.map)
    runs = []
    for seed in case.seeds:
        drive = case.simulate(grid, seed, case.seconds)
        localizer = Localizer(grid, settings, np.random.default_rng(seed))
        localizer.set_pose(drive.truth.map_from_base[0])
        runs.append(localize_drive(localizer, drive))
    metres = np.concatenate([run.metres for run in runs])
    return TrackingFigures(
        drives=len(runs),
        scans=len(metres),
        mean_m=float(metres.mean()),
        percentile_95_m=float(np.quantile(metres, 0.95)),
        largest_m=float(metres.max()),
        mean_deg=float(np.concatenate([run.degrees for run in runs]).mean()),
        share_inside_95=float(np.concatenate([run.is_inside for run in runs]).mean()),
        scans_lost=int(np.count_nonzero(metres >= LOST)),
        false_alarms=sum(_false_alarms(run) for run in runs),
    )


def _false_alarms(run: LocalizedDrive) -> int:
    alarmed = np.array([estimate.lost_probability > LOST for estimate in run.estimates])
    begun = int(np.count_nonzero(alarmed[1:] & ~alarmed[:-1]))
    return begun + sum(estimate.is_start for estimate in run.estimates[1:])
