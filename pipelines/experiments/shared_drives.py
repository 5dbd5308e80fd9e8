"""Simulated drives that several runs of a sweep share."""

from functools import lru_cache
from pathlib import Path

from racecar.maps.map_files import load_map
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import SimulationConfig

_EVERY = 2
"""Of 40 scans a second, 20 are used: the rate that the course asks for."""


@lru_cache(maxsize=4)
def simulated_drive(map_name: str, config: SimulationConfig) -> SimulatedDrive:
    """A drive through a shipped map; a process that is asked again has it at hand."""
    return simulate_drive(load_map(Path(map_name)), config, every=_EVERY)
