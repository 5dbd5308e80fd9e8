"""What users get wrong: one sentence, exit code 2, nothing half-written."""

import json
from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar, assert_refused


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_cut_bag_gives_the_map_of_what_is_left(
    racecar: Racecar, drive: Path, tmp_path: Path, share: float
) -> None:
    contents = (drive / "drive.bag").read_bytes()
    cut, out = tmp_path / "cut.bag", tmp_path / "out"
    cut.write_bytes(contents[: int(share * len(contents))])
    done = racecar("map", cut, "--out", out)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    report = json.loads((out / "report.json").read_text())
    assert report["warnings"]
    assert report["counts"]["scans"] > share * 6 * 40 * 0.8


@pytest.mark.parametrize(
    ("name", "contents"),
    [
        ("empty.bag", b""),
        ("text.bag", b"This is no bag.\n" * 100),
        ("empty.mcap", b""),
        ("text.db3", b"neither"),
        ("unknown.txt", b"x"),
    ],
)
def test_file_that_is_no_bag(racecar: Racecar, tmp_path: Path, name: str, contents: bytes) -> None:
    bag, out = tmp_path / name, tmp_path / "out"
    bag.write_bytes(contents)
    assert_refused(racecar("map", bag, "--out", out), name, out)
    assert_refused(racecar("check", bag), name, out)


def test_bag_that_is_not_there(racecar: Racecar, tmp_path: Path) -> None:
    bag, out = tmp_path / "absent.bag", tmp_path / "out"
    assert_refused(racecar("map", bag, "--out", out), "absent.bag", out)
    assert_refused(racecar("localize", bag, "--map", "track", "--out", out), "absent.bag", out)


@pytest.mark.parametrize("flag", ["--scan-topic", "--odom-topic"])
def test_misspelt_topic_names_the_topics_there_are(
    racecar: Racecar, drive: Path, tmp_path: Path, flag: str
) -> None:
    out = tmp_path / "out"
    done = racecar("map", drive / "drive.bag", "--out", out, flag, "/scna")
    assert_refused(done, "/scan", out)
    assert "/odom" in done.stderr


@pytest.mark.parametrize(
    ("image", "complaint"),
    [("missing.pgm", "missing.pgm"), ("../secret.pgm", "secret.pgm"), ("/etc/hostname", "hostname")],
)
def test_map_whose_image_is_missing_or_elsewhere(
    racecar: Racecar, drive: Path, tmp_path: Path, image: str, complaint: str
) -> None:
    (tmp_path / "secret.pgm").write_bytes(b"P5 2 2 255\n\xff\xff\xff\xff")
    (tmp_path / "maps").mkdir()
    yaml = tmp_path / "maps" / "map.yaml"
    yaml.write_text(
        f"image: {image}\nresolution: 0.05\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    out = tmp_path / "out"
    done = racecar("localize", drive / "drive.bag", "--map", yaml, "--out", out, "--global")
    assert_refused(done, complaint, out)


def test_config_with_a_typo(racecar: Racecar, drive: Path, tmp_path: Path) -> None:
    config, out = tmp_path / "config.yaml", tmp_path / "out"
    config.write_text("localization:\n  particels: 100\n")
    done = racecar("map", drive / "drive.bag", "--out", out, "--config", config)
    assert_refused(done, "did you mean 'localization.particles'", out)


def test_out_that_is_a_file(racecar: Racecar, drive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.write_text("mine")
    done = racecar("map", drive / "drive.bag", "--out", out)
    assert done.returncode == 2
    assert "is a file" in done.stderr
    assert out.read_text() == "mine"


@pytest.mark.parametrize(
    ("line", "complaint"),
    [("1.0 2.0", "line 2 of"), ("a b c d e f g h", "line 2 of")],
)
def test_trajectory_with_a_bad_line(
    racecar: Racecar, drive: Path, tmp_path: Path, line: str, complaint: str
) -> None:
    bad = tmp_path / "bad.tum"
    bad.write_text(f"1.0 0 0 0 0 0 0 1\n{line}\n")
    truth = drive / "drive.ground_truth.tum"
    for arguments in (
        (bad, "--reference", truth),
        (truth, "--reference", bad),
        (truth, "--relations", bad),
    ):
        assert_refused(racecar("evaluate", *arguments), complaint, tmp_path / "out")
