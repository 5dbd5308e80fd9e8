"""A simulated drive as input of a filter: its messages, and the ground truth."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan


@dataclass(frozen=True, eq=False)
class SimulatedDrive:
    """A recording with its ground truth."""

    grid: OccupancyGrid
    """The world it was recorded in."""
    messages: list[Measurement]
    """In time order."""
    truth: Trajectory
    """One pose per scan."""


def simulate_drive(grid: OccupancyGrid, config: SimulationConfig, *, every: int = 1) -> SimulatedDrive:
    """Drive through a world, keeping only every ``every``-th scan, starting with the first.

    Raises UserError when the world has no room for the car.
    """
    simulation = Simulation(grid, config)
    truth = simulation.ground_truth
    return SimulatedDrive(
        grid,
        list(every_nth_scan(simulation.messages(), every)),
        Trajectory(truth.stamps[::every], truth.map_from_base[::every]),
    )


def every_nth_scan(messages: Iterable[Measurement], n: int, first: int = 0) -> Iterator[Measurement]:
    """All odometry, and every nth scan starting with number ``first`` (from 0)."""
    scans = 0
    for message in messages:
        if isinstance(message, Scan):
            scans += 1
            if (scans - 1) % n != first:
                continue
        yield message
