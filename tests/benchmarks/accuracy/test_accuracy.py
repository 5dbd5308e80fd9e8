"""The command ``python -m benchmarks accuracy``."""

import json
from functools import partial
from pathlib import Path

import pytest

from benchmarks.accuracy import accuracy, drives
from benchmarks.accuracy.drives import tracking_drive
from benchmarks.accuracy.finding import FindingCase, FindingFigures, find
from benchmarks.accuracy.tracking import TrackingCase, TrackingFigures, track
from benchmarks.commands import run
from benchmarks.recordings.recordings import RecordingFigures, ScanComparison
from racecar.localization.config import LocalizationConfig
from racecar.pipelines.simulation.simulator_config import NoiseLevel


def test_a_drive_is_tracked() -> None:
    case = TrackingCase("building", partial(tracking_drive, noise=NoiseLevel.NONE), 4.0, [0])
    figures = track(case, LocalizationConfig())
    assert figures.drives == 1
    assert figures.scans == 160
    assert 0.0 < figures.mean_m < 0.05
    assert figures.scans_lost == figures.false_alarms == 0
    assert 0.5 < figures.share_inside_95 <= 1.0


def test_places_are_found_from_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drives, "_PLACES_SECONDS", 40.0)
    figures = find(FindingCase({"building": 2}, is_kidnapped=False), LocalizationConfig())
    assert figures.places == 2
    assert figures.share_found in (0.0, 0.5, 1.0)
    assert figures.share_noticed is None


def test_the_command_tells_every_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = FindingFigures(10, 3, 1.0, 0.9, 0.5)
    tracked = TrackingFigures(1, 160, 0.0111, 0.02, 0.03, 0.1, 0.95, 0, 2)
    matched = RecordingFigures(37, 0.0456, 0.1, 1, 5, [ScanComparison(50, 0.3, 0.1)])
    for measure, figures in {"track": tracked, "find": found, "match_recording": matched}.items():
        monkeypatch.setattr(accuracy, measure, lambda *_, told=figures, **__: told)
    (tmp_path / "racecar" / "session_A").mkdir(parents=True)
    monkeypatch.setenv("RACECAR_DATA", str(tmp_path))
    path = tmp_path / "figures.json"
    assert run(["accuracy", "--seeds", "1", "--json", str(path)]) == 0
    page = capsys.readouterr().out
    cells = ["session_A on our own map", "37", "0.046", "0.100", "1", "5"]
    assert any([cell.strip() for cell in line.split("|")[1:-1]] == cells for line in page.splitlines())
    assert page.count("0.0111") == 2 * 3 + 2 + 2 + 1
    assert page.count("90.0%") == 3
    written = json.loads(path.read_text())
    assert written["tracking"]["track, up to 7 m/s, 25 % slip"]["mean_m"] == 0.0111
    assert written["finding"]["anywhere"]["share_found"] == 0.9
    assert list(written["recordings"]) == ["session_A on our own map"]
    assert written["recordings"]["session_A on our own map"]["beyond"][0]["scan"] == 50


def test_no_drives_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["accuracy", "--seeds", "0"]) == 2
    assert capsys.readouterr().out == ""
