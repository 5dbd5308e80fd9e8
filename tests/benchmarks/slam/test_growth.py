"""The command ``python -m benchmarks growth``."""

import json
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.commands import run
from benchmarks.slam.growth import GrowthFigures
from benchmarks.slam.tables import growth_table


def test_the_figures_of_a_short_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("racecar.pipelines.warm_up.warm_up", dict)  # its kernels are compiled by other tests
    path = tmp_path / "figures.json"
    assert run(["growth", "--minutes", "0.1", "--json", str(path)]) == 0
    assert "Processor time per scan" in capsys.readouterr().out
    growth = json.loads(path.read_text())["growth"]
    assert growth["scans"] == 60  # 6 s at 10 a second
    assert 5 < growth["path_metres"] < 12
    assert 2 < growth["keyframes"] < growth["scans"]
    late, early = growth["milliseconds_per_scan"], growth["early_milliseconds_per_scan"]
    assert len(late) == len(early) == 10
    assert min(late + early) > 0
    assert len(growth["megabytes"]) == 10
    assert growth["keyframes_kept"] == growth["keyframes"]
    assert growth["ratio"] == late[-1] / early[-1]
    assert growth["finish_seconds"] > 0


def test_the_table_sets_the_last_tenth_against_the_first() -> None:
    figures = GrowthFigures(
        path_metres=12_345.0,
        scans=72_000,
        keyframes=30_000,
        keyframes_kept=2_000,
        milliseconds_per_scan=[2.0] * 9 + [2.5],
        early_milliseconds_per_scan=[1.5] * 9 + [2.0],
        megabytes=[50.0] * 9 + [64.2],
        finish_seconds=321.0,
    )
    page = StringIO()
    Console(file=page, width=200).print(growth_table(figures))
    shown = page.getvalue()
    assert "12.3 km with 72000 scans and 30000 keyframes, of which 2000 are kept" in shown
    row = next(line for line in shown.splitlines() if line.startswith("| scans of this tenth"))
    assert row.replace("|", "").split()[-4:] == ["2.50", "1.25", "0.032", "321.0"]


def test_a_drive_without_length_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["growth", "--minutes", "0"]) == 2
    assert capsys.readouterr().out == ""
