"""The drives played to the nodes."""

from dataclasses import dataclass
from pathlib import Path

from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@dataclass(frozen=True)
class PlayedDrive:
    """A bag to play, and what is known about it."""

    name: str
    bag: Path
    map: Path
    truth: Trajectory | None = None


def simulated_drive(folder: Path, seconds: float, seed: int) -> PlayedDrive:
    """A drive through the shipped building, with a known truth."""
    config = SimulationConfig(noise="slight", seed=seed, duration=seconds)
    simulation = Simulation(load_map(Path("building")), config)
    bag = folder / "simulated"
    write_bag(simulation, bag, lambda share: None)
    return PlayedDrive("simulated", bag, Path("building"), simulation.ground_truth)


def recorded_drive(recordings: Path) -> PlayedDrive | None:
    """The race car in the basement, if there are recordings."""
    bag = recordings / "racecar" / "session_A"
    if not bag.exists():
        return None
    return PlayedDrive("session_A", bag, recordings / "racecar" / "maps" / "stata_basement.yaml")
