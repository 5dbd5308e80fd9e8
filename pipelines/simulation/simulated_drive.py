"""A simulated drive as a filter takes it: its messages, and the truth they are measured against."""

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
    """What a car recorded, and where it was."""

    grid: OccupancyGrid
    """The world it drove through."""
    messages: list[Measurement]
    """In the order of time."""
    truth: Trajectory
    """One pose per scan."""


def simulate_drive(grid: OccupancyGrid, config: SimulationConfig, *, every: int = 1) -> SimulatedDrive:
    """Drive through a world; of the scans only one in ``every`` is kept, from the first on.

    Raises UserError when the car finds no room in it.
    """
    simulation = Simulation(grid, config)
    truth = simulation.ground_truth
    return SimulatedDrive(
        grid,
        list(every_nth_scan(simulation.messages(), every)),
        Trajectory(truth.stamps[::every], truth.map_from_base[::every]),
    )


def every_nth_scan(messages: Iterable[Measurement], n: int, first: int = 0) -> Iterator[Measurement]:
    """All odometry, and of the scans number ``first`` (from 0) and each nth after it."""
    scans = 0
    for message in messages:
        if isinstance(message, Scan):
            scans += 1
            if (scans - 1) % n != first:
                continue
        yield message
