"""Simulate, check, map, localize, evaluate: each command on what the one before it wrote."""

from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar, evaluated, report_of

MAP_FILES = {
    *("map.yaml", "map.pgm", "trajectory.tum", "pose_graph.g2o", "map.png", "report.json", "session.npz"),
}


@pytest.fixture(scope="module")
def built_map(racecar_command: Racecar, drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "map"
    done = racecar_command("map", drive / "drive.bag", "--out", out)
    assert "Traceback" not in done.stderr
    assert str(out / "map.png") in done.stdout
    return out


def test_simulated_bag_passes_the_check(racecar: Racecar, drive: Path) -> None:
    done = racecar("check", drive / "drive.bag")
    assert "/scan" in done.stdout


def test_map_writes_every_file(built_map: Path) -> None:
    assert {path.name for path in built_map.iterdir()} == MAP_FILES
    report = report_of(built_map)
    assert report["counts"]["scans"] > 100
    assert report["inputs"]["scan_topic"] == "/scan"
    assert report["peak_memory_mb"] > 0
    assert report["stages"]["total"]["wall_seconds"] > 0


def test_map_trajectory_is_right(racecar: Racecar, drive: Path, mapped: Path) -> None:
    figures = evaluated(racecar, mapped, "--reference", drive / "drive.ground_truth.tum")
    assert figures["matched_share"] > 0.95
    assert figures["absolute_position_m"]["mean"] < 0.05
    assert figures["absolute_heading_deg"]["mean"] < 1.0


def test_localize_on_the_built_map(racecar: Racecar, drive: Path, built_map: Path, tmp_path: Path) -> None:
    out = tmp_path / "localized"
    racecar(
        *("localize", drive / "drive.bag", "--map", built_map, "--out", out),
        *("--initial-pose", 0, 0, 0),
    )
    assert {"trajectory.tum", "report.json", "overlay.png"} <= {path.name for path in out.iterdir()}
    figures = evaluated(racecar, out, "--reference", built_map / "trajectory.tum")
    assert figures["absolute_position_m"]["mean"] < 0.10


def test_mapping_again_gives_the_same_bytes_in_another_process(mapped: Path, built_map: Path) -> None:
    for name in MAP_FILES - {"report.json"}:
        assert (mapped / name).read_bytes() == (built_map / name).read_bytes(), name


def test_without_odometry_the_report_tells_how_far_to_trust(
    racecar: Racecar, drive: Path, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    racecar("map", drive / "drive.bag", "--out", tmp_path, "--no-odom")
    report = report_of(tmp_path)
    assert report["inputs"]["odom_topic"] is None
    assert any("odometry" in sentence for sentence in report["warnings"])
    assert (tmp_path / "notes.txt").read_text() == "mine"
