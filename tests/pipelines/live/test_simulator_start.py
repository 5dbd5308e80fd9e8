"""A mistake with which the simulated car is started is told in a sentence, before anything drives."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.grid.occupancy_grid import OCCUPIED, OccupancyGrid
from racecar.maps.map_files import save_map
from racecar.pipelines.commands.cli import run


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--start", "100", "0", "0"], "The car cannot start at 100 0 0; the nearest place"),
        (["--start", "-0.1", "1.05", "0"], "The car cannot start at -0.1 1.05 0; the nearest place"),
        (["--start", "nan", "0", "0"], "The car cannot start at nan 0 0"),
        (["--namespace", "no good"], "ROS does not start"),
        (["--map", "nowhere"], "no map at nowhere"),
        (["--ros-args", "-p", "walkers:=-1"], "walkers"),
    ],
)
def test_a_mistake_at_the_start_is_one_sentence(
    flags: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["live", "simulate", "--map", "track", *flags]) == 2
    told = capsys.readouterr().err
    assert words in " ".join(told.split())
    assert "Traceback" not in told


def test_a_map_without_room_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    walls = np.full((40, 40), OCCUPIED, dtype=np.int8)
    save_map(OccupancyGrid(walls, 0.05, np.zeros(3)), tmp_path / "map.yaml")
    assert run(["live", "simulate", "--map", str(tmp_path / "map.yaml")]) == 2
    told = capsys.readouterr().err
    assert "no room" in told
    assert "Traceback" not in told
