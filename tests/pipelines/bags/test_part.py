"""A part of a bag, by the time of recording, whatever the storage."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.part import BagPart
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.cli import run
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import PLACE, START, bags_of_all_formats, write_bag

COUNT = 80  # scans, two seconds of them


@pytest.fixture(params=["ros1", "mcap", "sqlite"])
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return bags_of_all_formats(tmp_path, COUNT)[request.param]


def seconds_of_scans(path: Path, start: float = 0.0, duration: float | None = None) -> list[float]:
    with BagReader(path, start=start, duration=duration) as reader:
        messages = list(reader)
        assert reader.message_count == reader.messages_read
        assert np.allclose(reader.base_from_laser, PLACE)  # although its transform is left out
        assert any(isinstance(message, Odometry) for message in messages)
    return [(message.stamp - START) * 1e-9 for message in messages if isinstance(message, Scan)]


def test_what_was_recorded_before_and_after_is_left_out(bag: Path) -> None:
    whole = seconds_of_scans(bag)
    assert len(whole) == COUNT
    late = seconds_of_scans(bag, start=0.5)
    assert late == [second for second in whole if second >= 0.5]
    middle = seconds_of_scans(bag, start=0.5, duration=1.0)
    assert middle == [second for second in whole if 0.5 <= second <= 1.5]
    assert seconds_of_scans(bag, duration=0.25) == whole[:11]


def test_a_part_without_scans_is_refused(bag: Path) -> None:
    with pytest.raises(UserError, match=r"no scan from 30 s to 35 s in .*has scans from 0\.0 s to 2\.0 s"):
        BagReader(bag, start=30.0, duration=5.0)
    with pytest.raises(UserError, match="no scan from 30 s to the end in"):
        BagReader(bag, start=30.0)


@pytest.mark.parametrize(
    ("start", "duration"), [(-1.0, None), (np.nan, None), (0.0, 0.0), (0.0, -3.0), (0.0, np.nan)]
)
def test_what_is_not_seconds_is_refused(start: float, duration: float | None) -> None:
    with pytest.raises(UserError, match=r"cannot (start at|last)"):
        BagPart(start, duration)


def test_check_reads_the_part_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, figures = write_bag(tmp_path / "drive.bag", COUNT), tmp_path / "check.json"
    arguments = ["check", str(bag), "--start", "0.5", "--duration", "1", "--json", str(figures)]
    assert run(arguments) == 0
    assert "read from 0.5 s to 1.5 s" in capsys.readouterr().out
    written = json.loads(figures.read_text())
    assert written["scans"]["count"] == 41
    assert written["part"] == {"start": 0.5, "duration": 1.0}


def test_map_and_localize_read_the_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_bag(tmp_path / "drive.bag", COUNT)
    whole, cut, localized = tmp_path / "whole", tmp_path / "cut", tmp_path / "localized"
    assert run(["map", str(bag), "--out", str(whole), "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(cut), "--duration", "1", "--quiet"]) == 0
    part = ["--start", "0.5", "--duration", "1"]
    assert run(["localize", str(bag), "--map", str(whole), "--out", str(localized), *part, "--quiet"]) == 0
    lines = {each: (each / "trajectory.tum").read_text().splitlines() for each in (whole, cut, localized)}
    assert [len(each) for each in lines.values()] == [COUNT, 41, 41]
    assert lines[localized][0].split()[0] == lines[whole][20].split()[0]
    assert json.loads((cut / "report.json").read_text())["inputs"]["part"] == {"start": 0.0, "duration": 1.0}
    started = json.loads((localized / "report.json").read_text())["inputs"]
    assert started["start_source"] == "the map's trajectory.tum"
    rest = ["--start", "1.5", "--quiet", "--replace"]  # nothing that the first second's map has seen
    assert run(["localize", str(bag), "--map", str(cut), "--out", str(localized), *rest]) == 0
    report = json.loads((localized / "report.json").read_text())
    assert "against_mapping_trajectory" not in report["accuracy"]
    assert report["inputs"]["start_source"] == "the map's trajectory.tum"  # half a second away
    assert run(["map", str(bag), "--out", str(cut), "--start", "60", "--replace"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
