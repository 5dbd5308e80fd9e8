"""Commands from one end to the other, and a drive for them."""

from pathlib import Path

import pytest

from racecar.pipelines.live.ros.processes import private_environment
from tests.end_to_end.commands import Racecar, in_own_process, in_this_process, simulate
from tests.ros_domains import next_domain


@pytest.fixture(scope="session")
def racecar() -> Racecar:
    """Run ``racecar`` with some arguments."""
    return in_this_process


@pytest.fixture(scope="session")
def racecar_command() -> Racecar:
    """Run it in a process of its own."""
    return in_own_process


@pytest.fixture
def ros(has_ros: None, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """The environment of processes that talk over ROS."""
    environment = private_environment(next_domain())
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    return environment


@pytest.fixture(scope="session")
def drive(racecar: Racecar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short simulated drive in the building: drive.bag and drive.ground_truth.tum."""
    folder = tmp_path_factory.mktemp("drive")
    simulate(racecar, folder / "drive.bag", 6, "--seed", 3)
    return folder


@pytest.fixture(scope="session")
def mapped(racecar: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the map of that drive."""
    out = tmp_path_factory.mktemp("mapped") / "map"
    racecar("map", drive / "drive.bag", "--out", out, "--quiet")
    return out
