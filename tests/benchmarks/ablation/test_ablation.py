"""The command ``python -m benchmarks ablation``."""

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from benchmarks.ablation import ablation
from benchmarks.ablation.ablation import differences, localized
from benchmarks.ablation.ablation_drive import AblationDrive, DriveFigures
from benchmarks.ablation.effects import Effect, difference
from benchmarks.ablation.mechanisms import variants
from benchmarks.ablation.recorded_drives import recorded_drives
from benchmarks.ablation.simulated_drives import simulated_drives
from benchmarks.commands import run
from benchmarks.harness.variant import Variant
from racecar.localization.config import LocalizationConfig
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.simulation.simulated_drive import simulate_drive
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

DRIVES = ("racing, building", "noise, track", "racing, track")


def figures(*errors: float) -> list[DriveFigures]:
    return [DriveFigures(error, 0.0, 1) for error in errors]


def room() -> OccupancyGrid:
    cells = np.full((60, 90), OCCUPIED, dtype=np.int8)
    cells[2:58, 2:88] = FREE
    cells[30:40, 20:30] = cells[10:16, 60:75] = OCCUPIED
    return OccupancyGrid(cells, 0.1, np.array([0.0, 0.0, 0.0]))


def in_a_room(grid: OccupancyGrid) -> Callable[[int], AblationDrive]:
    def drive_of(seed: int) -> AblationDrive:
        settings = SimulationConfig(duration=1.0, seed=seed, noise=NoiseLevel.FULL, start=(4.0, 2.0, 0.3))
        drive = simulate_drive(grid, settings)
        return AblationDrive(grid, drive.messages, drive.truth, drive.truth.map_from_base[0])

    return drive_of


@pytest.mark.parametrize(
    ("without", "effect"),
    [
        ((0.0100, 0.0201, 0.0300, 0.0401), Effect.EQUAL),
        ((0.0150, 0.0252, 0.0350, 0.0448), Effect.PAYS),
        ((0.0050, 0.0152, 0.0250, 0.0348), Effect.COSTS),
        ((0.0100, 0.0201, 0.0300, 0.5000), Effect.OPEN),
    ],
)
def test_the_drives_in_pairs_tell_what_a_mechanism_does(without: tuple[float, ...], effect: Effect) -> None:
    found = difference(figures(0.01, 0.02, 0.03, 0.04), figures(*without))
    assert found.effect == effect.value
    assert found.difference_m[0] == pytest.approx(np.mean(without) - 0.025)


def test_the_standard_error_is_that_of_the_mean_difference() -> None:
    found = difference(figures(0.1, 0.2, 0.3), figures(0.2, 0.3, 0.7))
    assert found.difference_m[1] == pytest.approx(np.std([0.1, 0.1, 0.4], ddof=1) / np.sqrt(3))


def test_of_one_drive_nothing_is_said() -> None:
    assert difference(figures(0.1), figures(0.9)).effect == Effect.OPEN.value


def test_variants_are_measured_on_the_same_drives() -> None:
    drive_of, settings = in_a_room(room()), LocalizationConfig()
    tried = {"default": Variant(), "nothing": Variant(), "all sensor": variants()["all sensor"]}
    rows = {
        str(seed): {name: localized((drive_of(seed), seed), each, settings) for name, each in tried.items()}
        for seed in range(2)
    }
    default = [by_variant["default"] for by_variant in rows.values()]
    assert default[0] != default[1]
    assert all(0.0 < each.error_m < 0.05 and each.share_lost == 0.0 for each in default)
    found = differences(rows)
    assert found["nothing"].effect == Effect.IDLE.value
    assert abs(found["all sensor"].difference_m[0]) > 0.005


def test_a_lost_car_counts_as_a_metre_off() -> None:
    grid = room()
    drive = in_a_room(grid)(0)
    elsewhere = drive.truth.map_from_base + np.array([30.0, 0.0, 0.0])
    moved = AblationDrive(grid, drive.messages, Trajectory(drive.truth.stamps, elsewhere), drive.start)
    assert localized((moved, 0), Variant(), LocalizationConfig()) == DriveFigures(1.0, 1.0, 1)


def test_what_some_drives_are_for_is_in_them() -> None:
    drives = simulated_drives(2.0)
    without = drives["no odometry, track"](0)
    assert not any(isinstance(each, Odometry) for each in without.messages)
    hung = [each for each in drives["hung odometry, track"](0).messages if isinstance(each, Odometry)]
    repeats = [np.array_equal(a.odom_from_base, b.odom_from_base) for a, b in pairwise(hung)]
    assert 0.2 < np.mean(repeats) < 0.5
    halved = drives["halved odometry, track"](0)
    told = [each.odom_from_base[:2] for each in halved.messages if isinstance(each, Odometry)]
    driven = halved.truth.map_from_base[:, :2]
    assert 0.4 < lengths_along(np.array(told))[-1] / lengths_along(driven)[-1] < 0.9
    carried = drives["carried in a gap, track"](0)
    stamps = np.array([each.stamp for each in carried.messages if isinstance(each, Scan)])
    gap = int(np.argmax(np.diff(stamps)))
    assert stamps[gap + 1] - stamps[gap] > 2_500_000_000
    poses = carried.truth.map_from_base
    assert np.hypot(*(poses[gap + 1] - poses[gap])[:2]) > 1.9
    assert len(poses) == len(stamps)


def test_a_recording_is_localized_on_the_map_made_of_it(tmp_path: Path) -> None:
    settings = SimulationConfig(duration=4.0, start=(4.0, 2.0, 0.3))
    write_bag(Simulation(room(), settings), tmp_path / "tiny.bag", lambda share: None)
    (tmp_path / "tiny.relations").touch()
    drives = recorded_drives(tmp_path, Config(), seconds=2.0)
    assert list(drives) == ["tiny on our own map"]
    drive = drives["tiny on our own map"](0)
    assert drives["tiny on our own map"](1) is drive
    assert 70 <= len(drive.truth) <= 80
    assert localized((drive, 0), Variant(), LocalizationConfig()).error_m < 0.05


def test_the_command_tells_each_kind_and_all_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def told(drive_and_seed: object, variant: Variant, settings: object) -> DriveFigures:
        _, seed = drive_and_seed  # type: ignore[misc]
        return DriveFigures((0.02 if variant.replacements else 0.01) + (seed == 1) * 0.001, 0.0, 1)

    monkeypatch.setattr(ablation, "localized", told)
    monkeypatch.setattr(ablation, "simulated_drives", lambda _: dict.fromkeys(DRIVES, lambda seed: None))
    path = tmp_path / "ablation.json"
    command = ["ablation", "--data", str(tmp_path), "--seeds", "3", "--json", str(path)]
    assert run([*command, "--only", "trust", "--only", "racing, track", "--only", "noise, track"]) == 0
    page = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if "|" in line]
    assert rows.count(["trust", "0.0103", "0.0203", "+0.0100 ± 0.0000", "0.0%", "pays"]) == 2
    assert ["trust", "noise, track +0.0100; racing, track +0.0100", "", "0", "0", "0"] in rows
    written = json.loads(path.read_text())
    assert list(written["effects"]) == ["noise, track", "racing, track"]
    assert written["effects"]["racing, track"]["trust"]["effect"] == "pays"
    assert written["effects"]["racing, track"]["trust"]["drives"] == 3
    assert written["racing, track"]["1"]["trust"]["error_m"] == 0.021
    assert written["racing, track"]["1"]["default"]["error_m"] == 0.011


def test_a_mechanism_that_there_is_not_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["ablation", "--data", str(tmp_path), "--only", "magic"]) == 2
    assert "no mechanism or drive 'magic'" in capsys.readouterr().err
