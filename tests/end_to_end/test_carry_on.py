"""A second drive carries on the map of a first."""

from pathlib import Path

import numpy as np
import pytest

from racecar.maps.geometry.se2 import between
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.end_to_end.commands import Racecar, assert_refused, report_of
from tests.maps.shipped_plans import shipped_plan


def simulate(bag: Path, plan: str, config: SimulationConfig) -> Trajectory:
    simulation = Simulation(shipped_plan(plan), config)
    write_bag(simulation, bag, lambda share: None)
    return simulation.ground_truth


def test_a_second_drive_carries_on_the_map(racecar: Racecar, tmp_path: Path) -> None:
    first = simulate(tmp_path / "first.bag", "building", SimulationConfig(seed=1, duration=16.0))
    x, y, yaw = first.map_from_base[len(first) // 2].tolist()
    config = SimulationConfig(seed=2, duration=8.0, start=(x, y, yaw + np.pi))
    second = simulate(tmp_path / "second.bag", "building", config)
    simulate(tmp_path / "elsewhere.bag", "track", SimulationConfig(seed=3, duration=5.0))
    racecar("map", tmp_path / "first.bag", "--out", tmp_path / "one")
    begin_x, begin_y, begin_yaw = first.map_from_base[0].tolist()
    here = f"- here: 0.0\n  pose: [{begin_x}, {begin_y}, {np.degrees(begin_yaw)}]\n"
    (tmp_path / "one" / "edits.yaml").write_text(here)

    done = racecar("map", tmp_path / "second.bag", "--out", tmp_path / "both", "--continue", tmp_path / "one")
    found = load_tum(tmp_path / "both" / "trajectory.tum")
    assert len(found) == len(second)
    error = np.hypot(*(found.map_from_base - second.map_from_base)[:, :2].T)
    assert error.max() < 0.05
    assert "recordings: [1]" in (tmp_path / "both" / "edits.yaml").read_text()
    counts = {name: report_of(tmp_path / name)["counts"] for name in ("one", "both")}
    assert counts["both"]["keyframes_of_earlier_drives"] == counts["one"]["keyframes"]
    assert (load_map(tmp_path / "both").cells == 100).sum() >= (load_map(tmp_path / "one").cells == 100).sum()
    poses = (tmp_path / "both" / "pose_graph.g2o").read_text().count("VERTEX_SE2")
    assert poses == counts["both"]["keyframes"]

    wrong = ("--initial-pose", x + 1.0, y, yaw)
    more = ("map", tmp_path / "second.bag", "--continue", tmp_path / "one")
    done = racecar(*more, "--out", tmp_path / "wrong", *wrong, code=2)
    assert_refused(done, "see that the initial pose is where it begins", tmp_path / "wrong")

    out = tmp_path / "neither"
    more = ("map", tmp_path / "elsewhere.bag", "--out", out, "--continue", tmp_path / "one")
    assert_refused(racecar(*more, code=2), "not recognized on the earlier map", out)


@pytest.mark.slow
def test_a_short_drive_of_another_day_carries_on_a_map(
    racecar: Racecar, recordings: Path, tmp_path: Path
) -> None:
    one, two = recordings / "racecar" / "session_A", recordings / "racecar" / "localization_bag1.bag"
    other = recordings / "cartographer_runs" / "glc_ot_ez"
    racecar("map", one, "--out", tmp_path / "one")
    done = racecar("map", two, "--out", tmp_path / "both", "--continue", tmp_path / "one")
    done = racecar("map", other, "--out", tmp_path / "neither", "--continue", tmp_path / "one", code=2)
    assert "with that as the initial pose" in done.stderr
    localized = ("localize", two, "--map", tmp_path / "one", "--out", tmp_path / "localized")
    racecar(*localized, "--global")
    found, by_localizer = (load_tum(tmp_path / each / "trajectory.tum") for each in ("both", "localized"))
    apart = between(by_localizer.map_from_base[len(by_localizer) // 2 :], found.map_from_base[-1])
    assert np.hypot(*apart[-1, :2]) < 0.10
