"""``racecar map``: what it says of its map at the end, and its exit code."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.quality.map_quality import DoubtfulSegment, MapQuality, Verdict
from racecar.pipelines.commands.cli import run
from tests.pipelines.bag_samples import write_bag

WRONG = MapQuality(
    Verdict.WRONG,
    1.5,
    4.0,
    ("Walls lie apart.",),
    (DoubtfulSegment("Here.", (0, 1), np.array([1.0, 2.0]), (0.0, 1.5)),),
    {"spread_local": float("nan")},
)


def map_a_bag(folder: Path, *options: str) -> int:
    return run(["map", str(write_bag(folder / "drive.bag")), "--out", str(folder / "out"), *options])


def test_the_last_line_is_the_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The wheels of the sample drive while its scans stay the same."""
    assert map_a_bag(tmp_path, "--strict") == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert last.startswith("The map is doubtful: where walls hold, wheels and map differ by 93% of the way")
    assert json.loads((tmp_path / "out/report.json").read_text())["quality"]["verdict"] == "doubtful"


def test_a_wrong_map_is_written_and_told_and_strict_ends_in_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("racecar.mapping.mapper.judge", lambda *_: WRONG)
    assert map_a_bag(tmp_path) == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert last.startswith("The map is wrong")
    assert last.endswith("Walls lie apart. Here.")
    assert map_a_bag(tmp_path, "--strict", "--quiet") == 3
    told = json.loads((tmp_path / "out/report.json").read_text())["quality"]
    assert told["verdict"] == "wrong"
    assert told["statistics"] == {"spread_local": None}
    assert told["segments"][0]["to_s"] == 1.5
    assert (tmp_path / "out/map.png").exists()
