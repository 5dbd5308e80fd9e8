"""A long drive around the shipped building: does the cost of a scan grow with the drive?"""

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from benchmarks.harness.bench import Bench
from benchmarks.harness.table import Column
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.runs.progress import progress_bar
from racecar.pipelines.simulation.simulated_drive import every_nth_scan
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.measurement import Measurement

_PARTS = 10
"""The figures are split by tenths."""
_TAKEN = 4
"""Every fourth scan is mapped, i.e. 10 a second."""
_EARLY_EVERY = 4
"""Scans of the drive per scan of its first tenth that is mapped again in between."""


@dataclass(frozen=True)
class TenthFigures:
    """The cost of a tenth of the drive."""

    milliseconds_per_scan: Annotated[float, Column("ms per scan", ".2f")]
    """Mean processor time."""
    early_milliseconds_per_scan: Annotated[float, Column("of the first tenth, mapped again (ms)", ".2f")]
    """The same for the first tenth of the drive, mapped again by a fresh mapper. Its scans alternate with
    those of each tenth, so that other work on the machine slows both."""
    megabytes: Annotated[float, Column("memory added by then (MB)", ".0f")]
    """Increase of the resident memory by its end; nan if there is no /proc."""


@dataclass(frozen=True)
class GrowthFigures:
    """The cost of a long drive."""

    path_metres: Annotated[float, Column("path (m)", ".0f")]
    scans: Annotated[int, Column("scans")]
    keyframes: Annotated[int, Column("keyframes")]
    keyframes_kept: Annotated[int, Column("kept")]
    """Keyframes whose scans were kept."""
    ratio: Annotated[float, Column("last / first tenth", ".2f")]
    """Ratio of the time per scan in the last tenth to that for scans of the first."""
    megabytes_per_keyframe: Annotated[float, Column("MB per keyframe kept", ".3f")]
    """Memory at the end per keyframe whose scan was kept."""
    finish_seconds: Annotated[float, Column("finish (s)", ".1f")]
    """Wall time."""
    tenths: list[TenthFigures]


def growth(
    bench: Bench,
    minutes: Annotated[
        float, typer.Option("--minutes", min=0.1, metavar="MINUTES", help="Length of the simulated drive.")
    ] = 120.0,
) -> None:
    """Map a long simulated drive through the building and report whether a scan costs more towards its end.

    Example: python -m benchmarks growth --minutes 20
    """
    drive_on = partial(_drive_on, settings=bench.settings.mapping, seed=bench.seed, quiet=bench.quiet)
    drives = bench.each("growth", {f"{minutes:g} minutes": minutes}, drive_on, in_fresh_processes=True)
    bench.table("A long drive", drives)
    for drive in drives.values():
        tenths = {f"{number}. tenth": tenth for number, tenth in enumerate(drive.tenths, start=1)}
        bench.table("Processor time per scan", tenths)


def _drive_on(minutes: float, settings: MappingConfig, seed: int, *, quiet: bool) -> GrowthFigures:
    simulation = Simulation(
        load_map(shipped_map("building")), SimulationConfig(duration=60.0 * minutes, seed=seed)
    )
    scans = len(simulation.ground_truth) // _TAKEN
    mapper = Mapper(settings)
    seconds, early_seconds = _mapping(mapper, simulation), _first_tenth_again(settings, simulation, scans)
    times, early_times = np.zeros(scans), np.full(scans, np.nan)
    before, megabytes = 0.0, []
    ends = {int(part[-1]) for part in np.array_split(np.arange(scans), _PARTS)}
    with progress_bar("Driving", scans, quiet=quiet) as advance_to:
        for k in range(scans):
            times[k] = next(seconds)
            if k % _EARLY_EVERY == 0:
                early_times[k] = next(early_seconds)
            if k == 0:
                before = resident_memory_mb()  # after loading the kernels and the drive
            if k in ends:
                megabytes.append(resident_memory_mb() - before)
            advance_to(k + 1)
    early_seconds.close()
    started = time.perf_counter()
    with progress_bar("Optimizing", quiet=quiet) as advance_to:
        result = mapper.finish(advance_to)
    tenths = list(map(TenthFigures, _by_part(times), _by_part(early_times), megabytes))
    return GrowthFigures(
        path_metres=float(lengths_along(simulation.ground_truth.map_from_base[:, :2])[-1]),
        scans=scans,
        keyframes=len(result.keyframe_indices),
        keyframes_kept=result.counts["keyframes_kept"],
        ratio=tenths[-1].milliseconds_per_scan / tenths[-1].early_milliseconds_per_scan,
        megabytes_per_keyframe=megabytes[-1] / result.counts["keyframes_kept"],
        finish_seconds=time.perf_counter() - started,
        tenths=tenths,
    )


def _by_part(seconds: NDArray[np.float64]) -> list[float]:
    return [float(np.nanmean(part)) for part in np.array_split(1e3 * seconds, _PARTS)]


def _mapping(mapper: Mapper, simulation: Simulation) -> Iterator[float]:
    """Map a drive scan by scan; yields the seconds of processor time of each scan."""
    for replayed in replay(_taken(simulation), mapper, clock=time.process_time):
        yield replayed.seconds


def _taken(simulation: Simulation) -> Iterator[Measurement]:
    return every_nth_scan(simulation.messages(), _TAKEN, first=_TAKEN - 1)


def _first_tenth_again(
    settings: MappingConfig, simulation: Simulation, scans: int
) -> Generator[float, None, None]:
    """The same for the first tenth of the ``scans``, repeated, each time with a new mapper."""
    while True:
        yield from islice(_mapping(Mapper(settings), simulation), max(1, scans // _PARTS))
