"""What the localizer's benchmark runs on: a simulated drive, followed with a fixed number of particles."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.sensor.beams import Beams, select_beams
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.odometry import Odometry, OdometryBuffer
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.simulation.laser_sensor import SCAN_TIME
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class DriveStep:
    """What comes in from one scan to the next."""

    odometry: list[Odometry]
    scan: Scan
    map_from_base: Pose
    """The truth at the scan."""


class MeasuredDrive:
    """A localizer that follows a simulated drive of so many steps."""

    def __init__(
        self, grid: OccupancyGrid, config: LocalizationConfig, steps: int, warm_up_steps: int, seed: int
    ) -> None:
        """The first steps compile the kernels and gather the cloud. Raises UserError when no car has room."""
        self.config = config
        self.localizer = Localizer(grid, config, np.random.default_rng(seed))
        self._steps = iter(list(_simulated(grid, (steps + warm_up_steps + 4) * SCAN_TIME, seed)))
        self._odometry = OdometryBuffer()
        self.step = self.next_step()
        self.localizer.set_pose(self.step.map_from_base)
        self.feed()
        for _ in range(warm_up_steps):
            self.next_step()
            self.feed()

    def next_step(self) -> DriveStep:
        """Drive on to the next scan."""
        self.step = next(self._steps)
        for sample in self.step.odometry:
            self._odometry.add(sample)
        return self.step

    def feed(self) -> PoseEstimate:
        """The localizer's work in this step."""
        for sample in self.step.odometry:
            self.localizer.add_odometry(sample)
        return self.localizer.add_scan(self.step.scan)

    @property
    def beams(self) -> Beams:
        """Of the scan, as the localizer selects them."""
        return select_beams(self.step.scan, self.config.beams, self._odometry.pose_at)

    @property
    def odom_from_base(self) -> Pose:
        """(3,) at the scan."""
        return self._odometry.pose_at(self.step.scan.stamp)


class Stopwatch:
    """Gathers how much time of the processor this thread took for things, by name.

    On a machine with nothing else to do it is how long they took; other work there does not show.
    """

    def __init__(self) -> None:
        self._rounds: list[dict[str, list[float]]] = []
        self.begin_round()

    def begin_round(self) -> None:
        """What is timed from here on is compared with nothing before it."""
        self._rounds.append({})

    def time(self, name: str, work: Callable[[], _T]) -> _T:
        """Do the work once."""
        started = time.thread_time()
        result = work()
        self._rounds[-1].setdefault(name, []).append(time.thread_time() - started)
        return result

    def time_warm(self, name: str, work: Callable[[], object], repetitions: int) -> None:
        """Do it so often after a first time, which finds the caches as other work left them."""
        work()
        for _ in range(repetitions):
            self.time(name, work)

    def milliseconds(self, name: str) -> float:
        """The median."""
        return 1e3 * float(np.median([each for timed in self._rounds for each in timed.get(name, [])]))

    def ratio(self, name: str, to: str) -> float:
        """The median over the rounds, so that it does not matter how fast the processor was in which."""
        rounds = [timed for timed in self._rounds if name in timed and to in timed]
        return float(np.median([np.median(timed[name]) / np.median(timed[to]) for timed in rounds]))


def _simulated(grid: OccupancyGrid, seconds: float, seed: int) -> Iterator[DriveStep]:
    simulation = Simulation(grid, SimulationConfig(duration=seconds, seed=seed))
    poses = iter(simulation.ground_truth.map_from_base)
    odometry: list[Odometry] = []
    for message in simulation.messages():
        if isinstance(message, Odometry):
            odometry.append(message)
        else:
            yield DriveStep(odometry, message, next(poses))
            odometry = []
