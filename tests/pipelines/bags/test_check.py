"""What ``racecar check`` finds."""

import json

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.check import check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.cli import run
from racecar.pipelines.runs.bag_reading import BagReading, opened_bag
from racecar.sensors.config import SensorConfig
from racecar.sensors.grades import Grade
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import cut, read, write_bag


def check(path, **options):
    with BagReader(path, **options) as reader:
        return check_bag(reader)


def test_a_good_bag(tmp_path):
    result = check(write_bag(tmp_path / "drive.bag"))
    assert result.findings == []
    assert {topic.name: topic.message_count for topic in result.topics} == {
        "/tf_static": 1,
        "/odom": 200,
        "/scan": 200,
    }
    scans, driven = result.facts["scans"], result.facts["odometry"]
    assert (scans["count"], scans["beams_fewest"], scans["beams_most"]) == (200, 181, 181)
    assert scans["rate_hz"] == pytest.approx(40)
    assert scans["field_of_view_deg"] == pytest.approx(180)
    assert (scans["max_range_m"], scans["missed_share"]) == (30, 0)
    assert driven["path_length_m"] == pytest.approx(0.02 * 199, abs=0.01)
    assert driven["top_speed_m_s"] == pytest.approx(0.8)
    assert driven["scans_covered_share"] > 0.99
    assert result.facts["sensor"] == {
        "place": [0.25, 0.1, 0.5],
        "upside_down": False,
        "source": "tf_static",
    }


def test_what_is_wrong_is_found_each_with_a_remedy(tmp_path):
    def spoilt(index):
        ranges = np.full(181 if index < 50 else 100, np.nan, dtype=np.float32)
        ranges[:9] = 2.0
        return {"ranges": ranges} if index % 10 else None

    path = write_bag(
        tmp_path / "drive.bag",
        [*range(100), *range(1000, 1100)],
        place=None,
        wheels=lambda index: {"odom_from_base": np.array([0.001 * index + 50.0 * (index > 1050), 0.0, 0.0])},
        scans=spoilt,
    )
    result = check(path)
    assert {finding.name for finding in result.findings} >= {
        "scan_gaps",
        "changed_beam_counts",
        "beams_without_reading",
        "odometry_jumps",
        "place_unknown",
    }
    assert all(finding.remedy or finding.grade is Grade.FINE for finding in result.findings)


def test_a_bag_of_scans_without_beams_is_of_no_use(tmp_path):
    empty = {"ranges": np.empty(0, dtype=np.float32)}
    with pytest.raises(UserError, match=r"no usable scan.*hold no usable beams"):
        check(write_bag(tmp_path / "drive.bag", 10, with_odometry=False, scans=lambda _: empty))


def test_the_command_prints_and_writes_json(tmp_path, capsys):
    path = write_bag(tmp_path / "drive.bag")
    assert run(["check", str(path), "--json", str(tmp_path / "check.json")]) == 0
    printed = capsys.readouterr().out
    assert "/scan" in printed
    assert "No problems found" in printed
    content = json.loads((tmp_path / "check.json").read_text())
    assert content["scans"]["count"] == 200
    assert content["findings"] == []


def test_numbers_are_printed_as_people_write_them(tmp_path, capsys):
    assert run(["check", str(write_bag(tmp_path / "drive.bag"))]) == 0
    assert "returns from 2.00 to 2.20 m" in capsys.readouterr().out
    assert run(["check", str(blind_bag(tmp_path / "blind.bag"))]) == 0
    assert "no returns, misses from" in capsys.readouterr().out


def test_the_command_passes_a_cut_bag_with_findings(tmp_path, capsys):
    path = cut(write_bag(tmp_path / "drive.bag"), tmp_path / "cut.bag", 0.5)
    assert run(["check", str(path)]) == 0
    assert "cut off" in capsys.readouterr().out


def test_a_laser_that_hangs_upside_down_is_shown_so(tmp_path, capsys):
    path = str(write_bag(tmp_path / "drive.bag"))
    assert run(["check", path]) == 0
    assert "upside down" not in capsys.readouterr().out
    assert run(["check", path, "--laser-pose", "0.2", "0", "0", "3.1416"]) == 0
    assert "upside down" in capsys.readouterr().out


def blind_bag(path):
    """Of a laser that meets nothing."""
    nothing = {"ranges": np.full(181, 30.0, dtype=np.float32)}
    return write_bag(path, 40, place=None, scans=lambda _: nothing)


def test_strict_ends_in_3_where_a_map_would_be_wrong(tmp_path, capsys):
    good, blind = write_bag(tmp_path / "drive.bag"), blind_bag(tmp_path / "blind.bag")
    assert run(["check", str(good), "--strict"]) == 0
    assert run(["check", str(blind)]) == 0
    capsys.readouterr()
    assert run(["check", str(blind), "--strict", "--quiet", "--json", str(tmp_path / "check.json")]) == 3
    assert capsys.readouterr() == ("", "")
    spoiling = [
        finding["name"]
        for finding in json.loads((tmp_path / "check.json").read_text())["findings"]
        if finding["spoils_map"]
    ]
    assert spoiling == ["nothing_seen"]


def test_no_map_and_no_pose_comes_of_a_covered_laser(tmp_path, capsys):
    path = str(blind_bag(tmp_path / "blind.bag"))
    for arguments in (
        ["map", path],
        ["localize", path, "--map", "building", "--initial-pose", "0", "0", "0"],
    ):
        assert run([*arguments, "--out", str(tmp_path / "out"), "--quiet"]) == 2
        told = capsys.readouterr().err
        assert "Not one beam met anything" in told
        assert told.count("\n") == 1
        assert not (tmp_path / "out").exists()


def test_a_blank_stretch_is_noted_but_spoils_nothing(tmp_path):
    def covered(index):
        return {"ranges": np.zeros(181, dtype=np.float32)} if 40 <= index < 120 else {}

    (finding,) = check(write_bag(tmp_path / "drive.bag", scans=covered)).findings
    assert (finding.name, finding.spoils_map) == ("scans_blank", False)
    assert finding.numbers == {"count": 80, "scans": 200, "seconds": pytest.approx(2.0)}


def test_strict_minds_faults_only_that_spoil_the_map(tmp_path):
    cut_off = cut(write_bag(tmp_path / "drive.bag"), tmp_path / "cut.bag", 0.9)
    assert check(cut_off).findings
    assert run(["check", str(cut_off), "--strict", "--quiet"]) == 0


def test_whoever_reads_a_bag_hears_the_same_as_check(tmp_path):
    path = blind_bag(tmp_path / "blind.bag")
    told = [f"[{finding.grade.value}] {finding.sentence}" for finding in check(path).findings]
    *_, reader = read(path)
    assert told and reader.warnings == told


@pytest.mark.parametrize("arguments", [["nothing.bag"], ["drive.bag", "--scan-topic", "/scam"]])
def test_the_command_refuses_in_one_sentence(tmp_path, capsys, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    write_bag(tmp_path / "drive.bag", 3)
    assert run(["check", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1


def test_one_is_not_told_as_many(tmp_path):
    def fewer(index):
        return {"ranges": np.full(181 if index < 50 else 100, 2.0 + 0.001 * index, dtype=np.float32)}

    def jumping(index):
        return {"odom_from_base": np.array([0.02 * index + 50.0 * (index > 40), 0.0, 0.0])}

    findings = check(write_bag(tmp_path / "drive.bag", 60, wheels=jumping, scans=fewer)).findings
    assert [(finding.name, finding.numbers) for finding in findings] == [
        ("changed_beam_counts", {"count": 1}),
        ("odometry_jumps", {"times": "once"}),
    ]


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_sweeps_that_are_missing_here_and_there_are_no_fault(tmp_path, share):
    is_lost = np.random.default_rng(0).random(200) < share
    path = write_bag(tmp_path / "drive.bag", scans=lambda index: None if is_lost[index] else {})
    assert check(path).findings == []


@pytest.mark.parametrize(("beams", "is_told"), [(8, True), (19, True), (31, False), (181, False)])
def test_too_few_beams_to_match_are_told(tmp_path, beams, is_told):
    def few(index):
        ranges = np.full(beams, 2.0 + 0.001 * index, dtype=np.float32)
        return {"ranges": ranges, "angle_increment": np.pi / (beams - 1), "time_increment": 0.0}

    findings = check(write_bag(tmp_path / "drive.bag", 60, scans=few)).findings
    assert [(finding.name, finding.numbers["beams"], finding.spoils_map) for finding in findings] == [
        ("beams_too_few", beams, True)
    ] * is_told


def test_settings_of_the_sensors_count_for_a_bag_and_for_a_reader_that_is_open(tmp_path):
    bag, figures, settings = (
        write_bag(tmp_path / "drive.bag"),
        tmp_path / "check.json",
        tmp_path / "near.yaml",
    )
    settings.write_text("sensors: {max_range: 1.5}\n")
    assert run(["check", str(bag), "--config", str(settings), "--json", str(figures)]) == 0
    assert json.loads(figures.read_text())["scans"]["max_range_m"] == 1.5
    near = SensorConfig(max_range=1.5)
    with BagReader(bag, sensors=SensorConfig(max_range=2.5)) as reader:
        with opened_bag(reader, SensorConfig()) as same:
            assert next(item for item in same if isinstance(item, Scan)).max_range == 2.5
        with opened_bag(reader, near) as same:
            assert next(item for item in same if isinstance(item, Scan)).max_range == 1.5
    with BagReading().open(bag, near) as reader:
        assert reader.inputs["sensors"] == near.model_dump()
