"""The command ``python -m benchmarks slam``."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.commands import run
from benchmarks.harness.bench import Bench
from benchmarks.slam.false_loops import FalseLoopFigures
from benchmarks.slam.parts import PARTS
from benchmarks.slam.slam import LogFigures, left_out, show
from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.sensors.odometry import Odometry

SCANS = 60
STEP = 0.05
PERIOD = 50_000_000
BEARINGS = np.deg2rad(np.arange(-135.0, 135.0))
STAGES = {"reading", "scan matching", "optimization", "rest"}
SOME_PARTS = ("refinement", "loop closure", "velocity filter", "support of loops")
"""Each takes a process; that all can be left out, is tested beside them."""


def write_log(folder: Path) -> None:
    """A car that drives 5 cm a scan along x, in a room of 10 × 6 m; relations over 10 scans, one too late."""
    with BagWriter(folder / "room.bag") as writer:
        writer.write_static_transform(IDENTITY)
        for index in range(SCANS):
            x = STEP * index
            with np.errstate(divide="ignore"):
                to_ends = np.where(np.cos(BEARINGS) > 0, 6.0 - x, -4.0 - x) / np.cos(BEARINGS)
                to_sides = 3.0 / np.abs(np.sin(BEARINGS))
            ranges = np.minimum(to_ends, to_sides).astype(np.float32)
            writer.write_odometry(Odometry(index * PERIOD, np.array([x, 0.0, 0.0]), IDENTITY))
            writer.write_scan(index * PERIOD, ranges, BEARINGS[0], np.deg2rad(1.0), 0.0, 0.05, 0.1, 30.0)
    starts = [*range(0, SCANS - 10, 5), SCANS]
    lines = [f"{i * PERIOD * 1e-9:.6f} {(i + 10) * PERIOD * 1e-9:.6f} {10 * STEP} 0 0 0 0 0" for i in starts]
    (folder / "room.relations").write_text("\n".join(lines) + "\n")


def test_every_table_and_the_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("racecar.pipelines.commands.warm_up.warm_up", dict)
    monkeypatch.setattr("benchmarks.slam.slam.PARTS", {name: PARTS[name] for name in SOME_PARTS})
    write_log(tmp_path)
    (tmp_path / "settings.yaml").write_text("mapping:\n  resolution: 0.1\n")
    arguments = ["--ablation", "--false-loops", "--config", tmp_path / "settings.yaml", "--data", tmp_path]
    assert run(["slam", *map(str, arguments), "--json", str(tmp_path / "figures.json")]) == 0

    shown = capsys.readouterr()
    assert shown.out.count("| room ") == 3
    assert "logs: room" in shown.err
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["inputs"]["settings"]["mapping"]["resolution"] == 0.1
    assert figures["published"] == {}

    variants = figures["logs"]["room"]
    log = variants["default"]
    assert log["translation_m"][0] < 0.02
    assert log["relations"] == 11
    assert log["lost"] == 1
    assert log["report"]["counts"]["scans"] == SCANS
    assert set(log["seconds"]) >= STAGES
    assert sum(log["seconds"].values()) == pytest.approx(log["wall_seconds"])
    assert log["peak_memory_mb"] > 0

    assert set(variants) == {
        "default",
        "without wheel odometry",
        *(f"without {part}" for part in SOME_PARTS),
    }
    assert variants["without wheel odometry"]["translation_m"] != log["translation_m"]
    assert all(name in shown.out for name in variants)
    assert log["false_loops"]["wrong_loops"] <= log["false_loops"]["true_loops"]
    assert variants["without wheel odometry"]["false_loops"] is None


def figures_of(translation: float, lost: int = 0) -> LogFigures:
    return LogFigures((translation, 0.02), (0.3, 0.4), 100, lost, 10.0, 512.4, {}, None, {})


def test_what_is_left_out_has_a_row_and_each_log_a_column() -> None:
    runs = {
        "a": {"whole": figures_of(0.1), "less": figures_of(0.3)},
        "b": {"whole": figures_of(0.2), "less": figures_of(4.0, lost=2)},
    }
    assert left_out(runs) == {
        "whole": {"a": "0.1000 / 0.300", "b": "0.2000 / 0.300"},
        "less": {"a": "0.3000 / 0.300", "b": "4.0000 / 0.300 (2 lost)"},
    }


def test_a_log_is_shown_beside_what_was_published(capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(Config(), 0, Report("tests"), quiet=False, width=300)
    loops = FalseLoopFigures(30, 29, 0.02, 0.021, 1.05, 0.3, 0.36, 1.2)
    show(bench, {"intel": replace(figures_of(0.0123), false_loops=loops), "mine": figures_of(0.5, lost=7)})
    lines = capsys.readouterr().out.splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if "|" in line]
    ours = ["0.300 ± 0.400", "100", "0", "10.0", "512"]
    assert ["intel", "0.0123 ± 0.0200", *ours, "0.0229", "0.453", "179", "0.031", "0.070"] in rows
    assert ["mine", "0.5000 ± 0.0200", *ours[:2], "7", *ours[3:], *["–"] * 5] in rows
    assert ["intel", "30", "29", "0.0200", "0.0210", "1.050", "0.300", "0.360", "1.200"] in rows


def test_mistakes_are_told_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["slam", "--data", str(tmp_path)]) == 2
    shown = capsys.readouterr()
    assert "no benchmark log" in shown.err
    assert shown.err.count("\n") == 1
    assert shown.out == ""


def test_an_example_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["slam", "--help"]) == 0
    assert "Example: python -m benchmarks slam" in capsys.readouterr().out


def test_a_log_at_fault_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("racecar.pipelines.commands.warm_up.warm_up", dict)
    (tmp_path / "room.bag").write_bytes(b"no bag")
    (tmp_path / "room.relations").write_text("1 2 0 0 0 0 0\n")
    assert run(["slam", "--data", str(tmp_path), "--quiet"]) == 2
    shown = capsys.readouterr()
    assert "line 1 of" in shown.err
    assert shown.err.count("\n") == 1
    assert shown.out == ""


@pytest.mark.slow
def test_real_logs(recordings: Path, tmp_path: Path) -> None:
    path = tmp_path / "figures.json"
    assert run(["slam", "--data", str(recordings), "--json", str(path), "--quiet"]) == 0
    figures = json.loads(path.read_text())
    assert {"aces", "fr079", "intel"} <= set(figures["logs"])
    for log in ("aces", "fr079", "intel"):
        whole = figures["logs"][log]["default"]
        assert whole["lost"] == 0
        assert whole["translation_m"][0] <= 0.06
        assert figures["published"][log]["cartographer_seconds"] > 0
