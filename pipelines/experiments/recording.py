"""A recording to measure a filter on: a bag and the map it was driven on, or a simulated drive."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import find_map, load_map
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.experiments.filters import simulated_drive
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_SAME_SESSION = 1_000_000_000
"""Nanoseconds around the mapping trajectory's time within which a bag counts as the one that made the map."""


class Recording(Protocol):
    """Where scans and odometry come from; may be sent to another process."""

    @property
    def title(self) -> str:
        """What it is, in a few words."""

    @property
    def is_real(self) -> bool:
        """Whether a car was driven for it."""

    def load_map(self) -> OccupancyGrid:
        """The map to find the car on."""

    def start(self) -> Pose | None:
        """(3,) where the car is at the first scan; None when it is not known."""

    def end(self) -> Sequence[float] | None:
        """Where the car is at the last scan by tape measure: x, y and, if it was measured, yaw."""

    def messages(self) -> Iterator[Measurement]:
        """In the order of time."""


@dataclass(frozen=True)
class BagRecording:
    """A bag of one's own."""

    bag: Path
    map: Path
    initial_pose: tuple[float, float, float] | None = None
    end_pose: tuple[float, ...] | None = None
    scan_topic: Sequence[str] | None = None
    odom_topic: str | None = None
    laser_pose: tuple[float, ...] | None = None
    is_real: bool = True

    @property
    def title(self) -> str:
        return f"{self.bag.name} on {self.map.name}"

    def load_map(self) -> OccupancyGrid:
        return load_map(self.map)

    def start(self) -> Pose | None:
        """As the user said, or as the trajectory beside the map has it, if the bag made the map."""
        if self.initial_pose is not None:
            return np.array(self.initial_pose)
        path = find_map(self.map).parent / "trajectory.tum"
        if not path.is_file():
            return None
        with self._open() as reader:
            stamp = next(message.stamp for message in reader if isinstance(message, Scan))
        driven = load_tum(path)
        nearest = int(np.argmin(np.abs(driven.stamps - stamp)))
        is_same_session = abs(int(driven.stamps[nearest]) - stamp) <= _SAME_SESSION
        return driven.map_from_base[nearest] if is_same_session else None

    def end(self) -> Sequence[float] | None:
        return self.end_pose

    def messages(self) -> Iterator[Measurement]:
        with self._open() as reader:
            yield from reader

    @contextmanager
    def _open(self) -> Iterator[BagReader]:
        laser = None if self.laser_pose is None else np.array(self.laser_pose)
        with BagReader(
            self.bag, scan_topic=self.scan_topic, odom_topic=self.odom_topic, base_from_laser=laser
        ) as reader:
            yield reader


@dataclass(frozen=True)
class StandIn:
    """A simulated drive with people around, where no recording was given."""

    seed: int
    seconds: float
    is_real: bool = False

    @property
    def title(self) -> str:
        return "a simulated drive through the shipped building with four people about"

    def load_map(self) -> OccupancyGrid:
        return simulated_drive("building", self._config).grid

    def start(self) -> Pose:
        pose: Pose = simulated_drive("building", self._config).truth.map_from_base[0]
        return pose

    def end(self) -> Sequence[float]:
        end: list[float] = simulated_drive("building", self._config).truth.map_from_base[-1].tolist()
        return end

    def messages(self) -> Iterator[Measurement]:
        yield from simulated_drive("building", self._config).messages

    @property
    def _config(self) -> SimulationConfig:
        return SimulationConfig(
            noise=NoiseLevel.FULL, seed=self.seed, duration=self.seconds, walkers=4, max_speed=2.0
        )


def first_seconds(messages: Iterator[Measurement], seconds: float) -> Iterator[Measurement]:
    """The messages of the first seconds."""
    end = None
    for message in messages:
        end = message.stamp + int(seconds * 1e9) if end is None else end
        if message.stamp > end:
            return
        yield message


def known_start(recording: Recording) -> Pose:
    """Where a recording starts. Raises UserError when that is not known."""
    start = recording.start()
    if start is None:
        raise UserError(
            "The start of the car on the map is not known, and convergence is measured from there; give "
            "--initial-pose X Y YAW."
        )
    return start
