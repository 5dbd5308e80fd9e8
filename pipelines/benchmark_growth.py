"""A long drive round and round the shipped building: does a scan cost more the longer the drive has been?"""

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.config import MappingConfig
from mapping.mapper import Mapper
from maps.map_files import load_map
from maps.odometry import Odometry
from maps.shipped import shipped_map
from pipelines.benchmark_process import in_fresh_process
from pipelines.path_smoothing import lengths_along
from pipelines.progress import progress_bar
from pipelines.simulator import Simulation
from pipelines.simulator_config import SimulationConfig

_PARTS = 10
_TAKEN = 4
"""Every fourth scan is mapped, which makes 10 a second."""


@dataclass(frozen=True)
class GrowthFigures:
    """What a long drive came to."""

    path_metres: float
    scans: int
    keyframes: int
    milliseconds_per_scan: list[float]
    """Mean processor time of one scan in each tenth of the drive; other work on the machine does not show."""
    megabytes_per_keyframe: float
    """By how much the resident memory rose while scans came in; not a number where there is no /proc."""
    finish_seconds: float
    """Wall time."""

    @property
    def ratio(self) -> float:
        """Time per scan in the last tenth over that in the first."""
        return self.milliseconds_per_scan[-1] / self.milliseconds_per_scan[0]


def measure_growth(minutes: float, settings: MappingConfig, seed: int, *, quiet: bool) -> GrowthFigures:
    """Map a simulated drive of some minutes in a fresh process, whose memory is its own."""
    return in_fresh_process(partial(_drive_on, minutes, settings, seed, quiet=quiet))


def _drive_on(minutes: float, settings: MappingConfig, seed: int, *, quiet: bool) -> GrowthFigures:
    simulation = Simulation(
        load_map(shipped_map("building")), SimulationConfig(duration=60.0 * minutes, seed=seed)
    )
    mapper = Mapper(settings)
    with progress_bar("Driving", len(simulation.ground_truth), quiet=quiet) as advance_to:
        seconds, megabytes = _feed(mapper, simulation, advance_to)
    started = time.perf_counter()
    with progress_bar("Optimizing", quiet=quiet) as advance_to:
        result = mapper.finish(advance_to)
    finish_seconds = time.perf_counter() - started
    keyframes = len(result.keyframe_indices)
    return GrowthFigures(
        path_metres=float(lengths_along(simulation.ground_truth.map_from_base[:, :2])[-1]),
        scans=len(seconds),
        keyframes=keyframes,
        milliseconds_per_scan=[float(part.mean()) for part in np.array_split(1e3 * seconds, _PARTS)],
        megabytes_per_keyframe=megabytes / keyframes,
        finish_seconds=finish_seconds,
    )


def _feed(
    mapper: Mapper, simulation: Simulation, advance_to: Callable[[float], None]
) -> tuple[NDArray[np.float64], float]:
    """Seconds (N,) of processor time that each scan took, and by how many megabytes the memory grew."""
    seconds: list[float] = []
    seen, before = 0, 0.0
    for message in simulation.messages():
        if isinstance(message, Odometry):
            mapper.add_odometry(message)
            continue
        seen += 1
        if seen % _TAKEN:
            continue
        started = time.process_time()
        mapper.add_scan(message)
        seconds.append(time.process_time() - started)
        if len(seconds) == 1:
            before = _memory_mb()  # with the kernels loaded and the drive in memory
        advance_to(seen)
    return np.array(seconds), _memory_mb() - before


def _memory_mb() -> float:
    """Resident memory of this process now; the peak would hide what grows after the drive was planned."""
    pages = Path("/proc/self/statm")
    return (
        int(pages.read_text().split()[1]) * resource.getpagesize() / 1e6 if pages.exists() else float("nan")
    )
