"""The drive of the localizer's benchmark: simulated, and tracked with a fixed number of particles."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.sensor.end_points import EndPoints, select_points
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.laser_models import UST_10LX
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan


@dataclass(frozen=True, eq=False)
class DriveStep:
    """The input from one scan to the next."""

    odometry: list[Odometry]
    scan: Scan
    map_from_base: Pose
    """The true pose at the scan."""


class MeasuredDrive:
    """A localizer that tracks a simulated drive step by step."""

    def __init__(
        self, grid: OccupancyGrid, config: LocalizationConfig, steps: int, warm_up_steps: int, seed: int
    ) -> None:
        """The first steps compile the kernels and narrow the cloud. Raises UserError if no car has room."""
        self.config = config
        self.localizer = Localizer(grid, config, np.random.default_rng(seed))
        self._steps = iter(list(_simulated(grid, (steps + warm_up_steps + 4) * UST_10LX.scan_time, seed)))
        self._odometry = OdometryBuffer()
        self.step = self.next_step()
        self.localizer.set_pose(self.step.map_from_base)
        self.feed()
        for _ in range(warm_up_steps):
            self.next_step()
            self.feed()

    def next_step(self) -> DriveStep:
        """Advance to the next scan."""
        self.step = next(self._steps)
        for sample in self.step.odometry:
            self._odometry.add(sample)
        return self.step

    def feed(self) -> PoseEstimate:
        """Run the localizer for this step."""
        for sample in self.step.odometry:
            self.localizer.add_odometry(sample)
        return self.localizer.add_scan(self.step.scan)

    @property
    def points(self) -> EndPoints:
        """End points of the scan as selected by the localizer."""
        return select_points(self.step.scan, self.config.beams, self._odometry.pose_at)

    @property
    def odom_from_base(self) -> Pose:
        """(3,) at the scan."""
        return self._odometry.pose_at(self.step.scan.stamp)


def _simulated(grid: OccupancyGrid, seconds: float, seed: int) -> Iterator[DriveStep]:
    simulation = Simulation(grid, SimulationConfig(duration=seconds, seed=seed))
    poses = iter(simulation.ground_truth.map_from_base)
    odometry: list[Odometry] = []
    for message in simulation.messages():
        if isinstance(message, Odometry):
            odometry.append(message)
        elif isinstance(message, Scan):
            yield DriveStep(odometry, message, next(poses))
            odometry = []
