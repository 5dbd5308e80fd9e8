"""The command ``python -m benchmarks growth``."""

import json
from pathlib import Path

import pytest

from benchmarks.commands import run


def test_the_figures_of_a_short_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("racecar.pipelines.commands.warm_up.warm_up", dict)
    path = tmp_path / "figures.json"
    assert run(["growth", "--minutes", "0.1", "--json", str(path)]) == 0
    assert "Processor time per scan" in capsys.readouterr().out
    growth = json.loads(path.read_text())["growth"]["0.1 minutes"]
    assert growth["scans"] == 60  # 6 s at 10 a second
    assert 5 < growth["path_metres"] < 12
    assert 2 < growth["keyframes"] < growth["scans"]
    assert len(growth["tenths"]) == 10
    times = ("milliseconds_per_scan", "early_milliseconds_per_scan")
    late, early = ([tenth[name] for tenth in growth["tenths"]] for name in times)
    assert min(late + early) > 0
    assert growth["keyframes_kept"] == growth["keyframes"]
    assert growth["ratio"] == late[-1] / early[-1]
    assert growth["megabytes_per_keyframe"] == growth["tenths"][-1]["megabytes"] / growth["keyframes_kept"]
    assert growth["finish_seconds"] > 0


def test_a_drive_without_length_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["growth", "--minutes", "0"]) == 2
    assert capsys.readouterr().out == ""
