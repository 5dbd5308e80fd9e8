"""The command ``python -m benchmarks accuracy``."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import accuracy_benchmark
from benchmarks.accuracy.accuracy_benchmark import AccuracyBenchmark
from benchmarks.commands import run
from benchmarks.recordings import recordings_benchmark
from racecar.localization.config import LocalizationConfig
from racecar.pipelines.simulation.simulator_config import NoiseLevel


def quiet(sentence: str) -> None:
    """Announce nothing."""


def test_a_drive_is_tracked() -> None:
    figures = AccuracyBenchmark(LocalizationConfig(), 1, quiet).tracking("building", NoiseLevel.NONE, 4.0)
    assert figures.drives == 1
    assert figures.scans == 160
    assert 0.0 < figures.mean_m < 0.05
    assert figures.scans_lost == figures.false_alarms == 0
    assert 0.5 < figures.share_inside_95 <= 1.0


def test_places_are_found_from_nothing() -> None:
    figures = AccuracyBenchmark(LocalizationConfig(), 1, quiet, places_seconds=40.0).global_start(
        {"building": 2}
    )
    assert figures.places == 2
    assert figures.share_found == figures.found / 2
    assert figures.noticed is None


def test_the_command_tells_every_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = accuracy_benchmark.FindingFigures(10, 3, 9, 10, 0.5)
    tracked = accuracy_benchmark.TrackingFigures(1, 160, 0.0111, 0.02, 0.03, 0.1, 0.95, 0, 2)
    for row in ("tracking", "racing", "changed_map", "long_drive"):
        monkeypatch.setattr(AccuracyBenchmark, row, lambda *_: tracked)
    for row in ("global_start", "kidnapped"):
        monkeypatch.setattr(AccuracyBenchmark, row, lambda *_: found)
    (tmp_path / "racecar" / "session_A").mkdir(parents=True)
    beyond = [recordings_benchmark.Comparison(50, 0.3, 0.1)]
    matched = recordings_benchmark.RecordingFigures(37, 0.0456, 0.1, beyond, 5)
    monkeypatch.setattr(recordings_benchmark, "measure_recording", lambda *_, **__: matched)
    monkeypatch.setenv("RACECAR_DATA", str(tmp_path))
    path = tmp_path / "figures.json"
    assert run(["accuracy", "--seeds", "1", "--json", str(path)]) == 0
    page = capsys.readouterr().out
    cells = ["session_A on our own map", "37", "0.046", "0.100", "1", "5"]
    assert any([cell.strip() for cell in line.split("|")[1:-1]] == cells for line in page.splitlines())
    assert page.count("0.0111") == 2 * 3 + 2 + 2 + 1
    assert page.count("90.0 %") == 3
    assert "100.0 %" in page
    written = json.loads(path.read_text())
    assert np.isclose(written["tracking"]["track, up to 7 m/s, 25 % slip"]["mean_m"], 0.0111)
    assert written["finding"]["anywhere"]["found"] == 9
    assert list(written["recordings"]) == ["session_A on our own map"]
    assert written["recordings"]["session_A on our own map"]["beyond"][0]["scan"] == 50


def test_no_drives_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["accuracy", "--seeds", "0"]) == 2
    assert capsys.readouterr().out == ""
