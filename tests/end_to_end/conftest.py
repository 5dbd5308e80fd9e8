"""The real command, run as a user runs it."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Racecar = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def racecar() -> Racecar:
    """Run ``racecar`` with some arguments in a process of its own."""

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "racecar.pipelines.cli", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    return run


@pytest.fixture(scope="session")
def drive(racecar: Racecar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short simulated drive in the building: drive.bag and ground_truth.tum."""
    folder = tmp_path_factory.mktemp("drive")
    done = racecar(
        *("simulate", "--map", "building", "--out", folder / "drive.bag"),
        *("--noise", "slight", "--seed", "3", "--duration", "10", "--quiet"),
    )
    assert done.returncode == 0, done.stderr
    return folder
