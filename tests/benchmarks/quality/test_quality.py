"""Known errors are measured as they were put in, verdicts are counted, and the command makes maps."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.commands import run
from benchmarks.quality.known_drives import KnownDrive, recorded_drives
from benchmarks.quality.map_errors import MapErrors, map_errors
from benchmarks.quality.quality import drawn_spoilings, judged_map
from benchmarks.quality.verdict_figures import (
    JudgedMap,
    VerdictShare,
    kind_of,
    verdict_counts,
    verdict_shares,
)
from racecar.mapping.config import MappingConfig
from racecar.mapping.quality.config import QualityConfig
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.simulation.simulated_drive import simulate_drive
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import START, STEP, write_bag

STRAIGHT = np.column_stack([np.linspace(0.0, 40.0, 161), np.zeros(161), np.zeros(161)])


def errors_of(found: Pose) -> MapErrors:
    return map_errors(found, STRAIGHT, 10.0)


def test_the_frame_of_the_map_is_no_error() -> None:
    errors = errors_of(compose(np.array([5.0, -2.0, 1.0]), STRAIGHT))
    assert errors.path_m == pytest.approx(40.0)
    assert errors.local_m == pytest.approx(0.0, abs=1e-9)
    assert errors.whole_m == pytest.approx(0.0, abs=1e-9)


def test_a_scale_is_an_error_per_10_m_and_more_over_the_whole() -> None:
    errors = errors_of(STRAIGHT * [1.02, 1.0, 1.0])
    assert errors.local_m == pytest.approx(0.2, rel=0.01)
    assert errors.whole_m == pytest.approx(0.02 * 40.0 / 3.0, rel=0.05)


def test_a_jump_is_the_worst_place() -> None:
    found = STRAIGHT + [0.0, 1.0, 0.0] * (STRAIGHT[:, :1] > 20.0)
    errors = errors_of(found)
    assert errors.worst_m == pytest.approx(1.0)
    first, second = STRAIGHT[list(errors.worst), 0]
    assert first <= 20.0 < second
    assert errors.local_m == pytest.approx(10.0 / 30.0, rel=0.1)


def test_passes_that_lie_beside_each_other_are_a_local_error() -> None:
    true = np.concatenate([STRAIGHT, STRAIGHT[::-1]])
    found = true + [0.0, 0.5, 0.0] * (np.arange(len(true)) >= len(STRAIGHT))[:, None]
    assert map_errors(found, true, 10.0).local_m == pytest.approx(0.5)


def judged(local: float, whole: float, verdict: str, place_off: float | None = None) -> JudgedMap:
    errors = MapErrors(40.0, local, whole, 2 * local, (3, 9))
    return JudgedMap(kind_of(errors, QualityConfig()), verdict, errors, 0.05, 0.2, place_off, 0.25, 0.1, {})


def test_verdicts_are_counted_by_what_the_map_is() -> None:
    maps = [
        judged(0.01, 0.1, "good"),
        judged(0.05, 0.1, "wrong"),
        judged(0.2, 0.1, "doubtful"),
        judged(0.05, 2.0, "wrong", 3.0),
        judged(0.4, 0.1, "good"),
    ]
    assert [each.kind for each in maps] == ["good", "good", "between", "wrong", "wrong"]
    assert verdict_counts(maps)["wrong"] == {"good": 1, "doubtful": 0, "wrong": 1}
    assert list(verdict_shares(maps).values()) == [
        VerdictShare(0.5),
        VerdictShare(0.5),
        VerdictShare(0.2),
        VerdictShare(3 / 5, 3 / 5),  # 3 cm and less are the same; 10 cm
        VerdictShare(4 / 5, 4 / 5),
        VerdictShare(0.5, 0.25),
    ]


def test_where_the_reference_has_a_hole_the_car_is_not_known() -> None:
    stamps = np.array([0, 1, 2, 9, 10]) * 10**9
    drive = KnownDrive("hole", [], Trajectory(stamps, np.zeros((5, 3))), IDENTITY)
    asked = np.array([-1, 0, 1, 5, 9, 10, 11]) * 10**9
    assert drive.is_known(asked).tolist() == [False, True, True, False, False, True, False]


def test_recordings_are_those_with_a_reference_beside_them(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"reference\.tum"):
        next(recorded_drives(tmp_path))
    (tmp_path / "lap").mkdir()
    write_bag(tmp_path / "lap" / "lap.bag", 50)
    truth = Trajectory(START + np.arange(50) * STEP, np.zeros((50, 3)))
    save_tum(truth, tmp_path / "lap" / "reference.tum")
    (drive,) = recorded_drives(tmp_path)
    assert drive.name == "lap"
    assert len(drive.messages) == 100
    assert len(drive.truth) == 50


@pytest.mark.slow
def test_a_right_map_is_called_good() -> None:
    settings = SimulationConfig(duration=20.0, scan_every=0.1, noise="none", seed=1)
    drive = simulate_drive(load_map(Path("track")), settings)
    mount = next(message.base_from_laser for message in drive.messages if isinstance(message, Scan))
    known = KnownDrive("track 1", drive.messages, drive.truth, mount)
    (as_it_is,) = drawn_spoilings(known, 0).values()
    right = judged_map(known, as_it_is, MappingConfig())
    assert right is not None
    assert right.verdict == "good"
    assert right.errors.local_m < 0.05
    assert right.place_off_m is None
    assert right.statistics


@pytest.mark.slow
def test_the_command_prints_the_table_and_writes_every_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("benchmarks.quality.known_drives._MAPS", ("track",))
    arguments = ["--drives", "1", "--faults", "1", "--json", str(tmp_path / "quality.json")]
    assert run(["quality", *arguments]) == 0
    shown = capsys.readouterr()
    assert "wrong maps called good" in shown.out
    assert "maps: track 0" in shown.err
    assert "  as it is: is " in shown.err
    report = json.loads((tmp_path / "quality.json").read_text())
    assert len(report["maps"]["track 0"]) == 2
    assert sum(sum(counts.values()) for counts in report["figures"]["counts"].values()) == 2


def test_nothing_to_judge_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["quality", "--drives", "0"]) == 2
    assert "--drives" in capsys.readouterr().err
