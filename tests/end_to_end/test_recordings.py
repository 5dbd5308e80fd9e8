"""The real commands on real recordings."""

from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar, evaluated, report_of

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("log", "bag"), [("intel", "intel.bag"), ("fr079", "fr079"), ("aces", "aces")])
def test_benchmark_log(
    racecar_command: Racecar, recordings: Path, tmp_path: Path, log: str, bag: str
) -> None:
    folder = recordings / "slam_benchmark"
    racecar_command("map", folder / bag, "--out", tmp_path)
    figures = evaluated(racecar_command, tmp_path, "--relations", folder / f"{log}.relations")
    assert figures["lost"] == 0
    assert figures["translation_mean_m"] <= 0.06


@pytest.mark.parametrize("run", ["hangar_pus_30_v1", "glc_ot_ez"])
def test_cartographers_poses(racecar_command: Racecar, recordings: Path, tmp_path: Path, run: str) -> None:
    folder = recordings / "cartographer_runs"
    racecar_command("map", folder / run, "--out", tmp_path)
    figures = evaluated(racecar_command, tmp_path, "--reference", folder / f"{run}.cartographer.tum")
    assert figures["matched_share"] > 0.95
    assert figures["absolute_position_m"]["mean"] <= 0.10


def test_race_car_on_its_own_map(racecar_command: Racecar, recordings: Path, tmp_path: Path) -> None:
    bag = recordings / "racecar" / "session_A"
    racecar_command("map", bag, "--out", tmp_path / "map")
    racecar_command(
        *("localize", bag, "--map", tmp_path / "map", "--out", tmp_path / "localized"),
        *("--initial-pose", 0, 0, 0),
    )
    mapped = tmp_path / "map" / "trajectory.tum"
    figures = evaluated(racecar_command, tmp_path / "localized", "--reference", mapped)
    assert figures["absolute_position_m"]["mean"] <= 0.10


def test_race_car_without_odometry(racecar_command: Racecar, recordings: Path, tmp_path: Path) -> None:
    """Also before, and after, the pauses of the recording."""
    bag = recordings / "racecar" / "session_A"
    racecar_command("map", bag, "--out", tmp_path / "with")
    racecar_command("map", bag, "--out", tmp_path / "without", "--no-odom")
    report = report_of(tmp_path / "without")
    assert any("odometry" in sentence for sentence in report["warnings"])
    with_wheels = tmp_path / "with" / "trajectory.tum"
    figures = evaluated(racecar_command, tmp_path / "without", "--reference", with_wheels)
    assert figures["absolute_position_m"]["mean"] <= 0.03
    assert figures["absolute_position_m"]["max"] <= 0.3


@pytest.mark.parametrize("share", [0.3, 0.9])
@pytest.mark.parametrize(
    "recording",
    [
        "slam_benchmark/intel.bag",
        "slam_benchmark/fr079/fr079.db3",
        "slam_benchmark/aces/aces.mcap",
        "racecar/session_A/session_A.mcap",
        "racecar/localization_bag1.bag",
        "cartographer_runs/glc_ot_ez/glc_ot_ez.db3",
        "cartographer_runs/hangar_pus_30_v1/hangar_pus_30_v1.mcap",
    ],
)
def test_cut_copy(
    racecar_command: Racecar, recordings: Path, tmp_path: Path, recording: str, share: float
) -> None:
    """Either a map of what could be read, or one sentence and nothing written."""
    whole = recordings / recording
    cut, out = tmp_path / f"cut{whole.suffix}", tmp_path / "out"
    cut.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
    done = racecar_command("map", cut, "--out", out, code=None)
    assert "Traceback" not in done.stderr
    if done.returncode == 2:
        assert done.stderr.strip().count("\n") == 0
        assert not out.exists()
    else:
        assert report_of(out)["warnings"]
