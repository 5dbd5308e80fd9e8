"""A long drive round the shipped building: does a scan cost more, the longer the drive has been?"""

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.maps.map_files import load_map
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.shipped import shipped_map
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.files.report import resident_memory_mb
from racecar.pipelines.runs.other_process import in_fresh_process
from racecar.pipelines.runs.progress import progress_bar
from racecar.pipelines.simulation.path_smoothing import lengths_along
from racecar.pipelines.simulation.simulated_drive import every_nth_scan
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig

_PARTS = 10
"""Tenths, by which the figures are split."""
_TAKEN = 4
"""Every fourth scan is mapped, which makes 10 a second."""
_EARLY_EVERY = 4
"""Scans of the drive for each one of its first tenth that is mapped again in between."""


@dataclass(frozen=True)
class GrowthFigures:
    """The cost of a long drive."""

    path_metres: float
    scans: int
    keyframes: int
    keyframes_kept: int
    """Those whose scans were kept."""
    milliseconds_per_scan: list[float]
    """Mean processor time of one scan in each tenth of the drive."""
    early_milliseconds_per_scan: list[float]
    """The same in the first tenth of the drive, mapped again by a mapper that has just begun: its scans take
    turns with those of each tenth, so that other work on the machine slows both."""
    megabytes: list[float]
    """By how much the resident memory had risen at the end of each tenth; nan where there is no /proc."""
    finish_seconds: float
    """Wall time."""

    @property
    def megabytes_per_keyframe(self) -> float:
        """Memory at the end, by the keyframes whose scans were kept."""
        return self.megabytes[-1] / self.keyframes_kept

    @property
    def ratio(self) -> float:
        """Time per scan in the last tenth over that of scans of the first."""
        return self.milliseconds_per_scan[-1] / self.early_milliseconds_per_scan[-1]


def measure_growth(minutes: float, settings: MappingConfig, seed: int, *, quiet: bool) -> GrowthFigures:
    """Map a simulated drive of some minutes in a fresh process, whose memory is its own."""
    return in_fresh_process(partial(_drive_on, minutes, settings, seed, quiet=quiet))


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
                before = resident_memory_mb()  # with the kernels loaded and the drive in memory
            if k in ends:
                megabytes.append(resident_memory_mb() - before)
            advance_to(k + 1)
    early_seconds.close()
    started = time.perf_counter()
    with progress_bar("Optimizing", quiet=quiet) as advance_to:
        result = mapper.finish(advance_to)
    finish_seconds = time.perf_counter() - started
    return GrowthFigures(
        path_metres=float(lengths_along(simulation.ground_truth.map_from_base[:, :2])[-1]),
        scans=scans,
        keyframes=len(result.keyframe_indices),
        keyframes_kept=result.counts["keyframes_kept"],
        milliseconds_per_scan=_by_part(times),
        early_milliseconds_per_scan=_by_part(early_times),
        megabytes=megabytes,
        finish_seconds=finish_seconds,
    )


def _by_part(seconds: NDArray[np.float64]) -> list[float]:
    return [float(np.nanmean(part)) for part in np.array_split(1e3 * seconds, _PARTS)]


def _mapping(mapper: Mapper, simulation: Simulation) -> Iterator[float]:
    """Map a drive scan by scan; yields the seconds of processor time that each took."""
    for replayed in replay(_taken(simulation), mapper, clock=time.process_time):
        yield replayed.seconds


def _taken(simulation: Simulation) -> Iterator[Measurement]:
    return every_nth_scan(simulation.messages(), _TAKEN, first=_TAKEN - 1)


def _first_tenth_again(
    settings: MappingConfig, simulation: Simulation, scans: int
) -> Generator[float, None, None]:
    """The same for the first tenth of the ``scans``, again and again, each time by a new mapper."""
    while True:
        yield from islice(_mapping(Mapper(settings), simulation), max(1, scans // _PARTS))
