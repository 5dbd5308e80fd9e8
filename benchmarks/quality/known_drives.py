"""Drives with known true poses: simulated ones, and recordings with a reference."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.input_faults import fewer_beams
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.simulation.simulated_drive import simulate_drive
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

REFERENCE = "reference.tum"
"""The name of the file with true poses beside a bag, by definition."""
_BAGS = (".bag", ".db3", ".mcap")
_FARTHEST_POSES = 3_000_000_000
"""Nanoseconds between two reference poses above which the pose in between is unknown. Chosen by judgement:
several metres of driving."""

_MAPS = ("building", "track", "twin_corridors", "bare_corridor", "long_track", "campus")
_AILMENTS: tuple[dict[str, Any], ...] = (
    {"walkers": 8},
    {"slip": 0.25},
    {"laser": "short"},
    {"laser": "round", "follower": True},
    {"tilt": 2.0, "hills": 0.02},
    {"posts": 3},
    {"carried": 4.0},
    {"carried": 8.0, "carrier": True},
    {"steering": True},
    {"max_speed": 1.0, "scan_every": 1.0, "duration": 90.0},
    {"max_speed": 1.0, "scan_every": 2.0, "duration": 120.0},
    {"max_speed": 1.0, "scan_gaps": 3.0, "duration": 60.0},
)
"""Problems of the car or its surroundings; a drive has one or none of them."""
_WELL = 0.4
"""Share of the drives without a problem. Chosen by judgement: most recordings are plain."""


@dataclass(frozen=True, eq=False)
class KnownDrive:
    """A recorded drive and its true poses."""

    name: str
    messages: list[Measurement]
    truth: Trajectory
    mount: Pose
    """(3,) of the laser on the base of the true poses; that of the scans may have been corrected."""

    def is_known(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) whether the true pose is known at stamps (N,)."""
        known = self.truth.stamps
        after = np.clip(np.searchsorted(known, stamps), 1, len(known) - 1)
        is_near: NDArray[np.bool_] = known[after] - known[after - 1] < _FARTHEST_POSES
        is_near &= (stamps >= known[0]) & (stamps <= known[-1])
        return is_near


def simulated_drives(count: int, seed: int) -> Iterator[KnownDrive]:
    """``count`` drives through each of the worlds, each with its own seed."""
    for number in range(seed, seed + count):
        for plan in _MAPS:
            draw = random.Random(f"{plan} {number}")
            settings = _drawn(draw) | ({"laser": "outdoor"} if plan == "campus" else {})
            drive = simulate_drive(_plan(plan), SimulationConfig(**settings, seed=number))
            is_thin = draw.random() < 0.5  # most lasers have a few hundred beams
            messages = fewer_beams(drive.messages, 3) if is_thin else drive.messages
            mount = next(m.base_from_laser for m in messages if isinstance(m, Scan))
            yield KnownDrive(f"{plan} {number}", messages, drive.truth, mount)


def recorded_drives(folder: Path) -> Iterator[KnownDrive]:
    """The recordings in a folder that have a reference beside them, with their sensors corrected.

    Raises UserError if there is none.
    """
    references = sorted(folder.rglob(REFERENCE))
    if not references:
        raise UserError(f"No recording in {folder} has a file {REFERENCE} beside it.")
    for reference in references:
        bags = [path for path in sorted(reference.parent.iterdir()) if path.suffix in _BAGS]
        if not bags:
            raise UserError(f"There is no bag beside {reference}.")
        with BagReader(bags[0]) as reader:
            mount = reader.base_from_laser
            calibrate(reader, RunContext())
            messages = list(reader)
        yield KnownDrive(reference.parent.name, messages, load_tum(reference), mount)


def _drawn(draw: random.Random) -> dict[str, Any]:
    """Random settings of `SimulationConfig`."""
    usual = {
        "noise": draw.choice(["none", "slight", "full", "full"]),
        "duration": draw.choice([25.0, 35.0, 45.0]),
        "max_speed": draw.choice([1.0, 1.5, 2.0, 3.0]),
        "scan_every": 0.1,
    }
    return {**usual, **({} if draw.random() < _WELL else draw.choice(_AILMENTS))}


@cache
def _plan(name: str) -> OccupancyGrid:
    """Always the same object, so that the path through it is planned once."""
    return load_map(Path(name))
