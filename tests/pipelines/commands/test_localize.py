import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveQuality, DriveVerdict
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map, save_map
from racecar.maps.shipped import shipped_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.localize import summary
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.tum import load_tum, save_tum
from racecar.sensors.odometry import Odometry

BEARINGS = np.linspace(-2.35, 2.35, 271)
PERIOD = 50_000_000
STAMPS = 10**9 + PERIOD * np.arange(40)
TRUTH = np.column_stack([np.linspace(2.0, 7.0, 40), np.full(40, 2.5), np.zeros(40)])


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A car that drives 5 m through a room whose map is in the folder ``map``."""
    cells = np.full((100, 160), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[3:20, 30:44] = OCCUPIED
    cells[80:, 100:110] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    (tmp_path / "map").mkdir()
    save_map(grid, tmp_path / "map" / "map.yaml")
    write_drive(tmp_path / "drive.bag")
    return tmp_path / "drive.bag"


def write_drive(bag: Path, covered: int = 0) -> None:
    """Of whose scans the first so many are those of a covered laser."""
    with BagWriter(bag) as writer:
        writer.write_static_transform(IDENTITY)
        for number, (stamp, pose) in enumerate(zip(STAMPS.tolist(), TRUTH, strict=True)):
            ranges = cast_ray_fan(load_map(bag.parent / "map"), pose[None], BEARINGS, 30.0)[0]
            ranges = np.where(number < covered, np.inf, ranges).astype(np.float32)
            step = float(BEARINGS[1] - BEARINGS[0])
            writer.write_odometry(Odometry(stamp, pose - TRUTH[0], IDENTITY))
            writer.write_scan(stamp, ranges, float(BEARINGS[0]), step, 0.0, 0.05, 0.1, 30.0)


def localize(bag: Path, *flags: str) -> int:
    places = ["--map", str(bag.parent / "map"), "--out", str(bag.parent / "out"), "--replace"]
    return run(["localize", str(bag), *places, *flags])


def mean_error(bag: Path) -> float:
    trajectory = load_tum(bag.parent / "out" / "trajectory.tum")
    np.testing.assert_array_equal(trajectory.stamps, STAMPS)
    return float(np.mean(np.hypot(*(trajectory.map_from_base - TRUTH)[:, :2].T)))


@pytest.mark.parametrize("flags", [("--initial-pose", "2.2", "2.4", "0.1"), ("--global",), ()])
def test_writes_all_files_and_tells_the_fit(bag: Path, flags: tuple[str, ...]) -> None:
    assert localize(bag, *flags) == 0
    names = {path.name for path in (bag.parent / "out").iterdir()}
    assert names == {"trajectory.tum", "overlay.png", "report.json"}
    assert mean_error(bag) < 0.05
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert report["accuracy"]["share_of_end_points_within_0.10_m_of_a_wall"] > 0.95
    assert report["counts"]["scans"] == 40
    assert report["update_ms"]["percentile_99"] >= report["update_ms"]["mean"] > 0
    assert report["convergence"]["seconds_until_found"] < 1.0


def leave_mapping_drive(bag: Path, drive: Trajectory, inputs: dict[str, str]) -> None:
    """What the mapper leaves beside a map of what it was made from."""
    save_tum(drive, bag.parent / "map" / "trajectory.tum")
    (bag.parent / "map" / "report.json").write_text(json.dumps({"inputs": inputs}))


@pytest.mark.parametrize("is_moved", [False, True])
def test_the_bag_that_made_the_map_starts_where_it_was(
    bag: Path, is_moved: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    named = {"bag": str(bag)}
    if is_moved:  # it is known by its content
        named = {"bag": "/elsewhere/drive.bag", "bag_fingerprint": bag_fingerprint(bag)}
    leave_mapping_drive(bag, Trajectory(STAMPS, TRUTH), named)
    assert localize(bag) == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert report["inputs"]["start_source"] == "the map's trajectory.tum"
    assert report["accuracy"]["against_mapping_trajectory"]["absolute_position_m"]["mean"] < 0.05
    assert "away on average" in capsys.readouterr().out


def test_another_drive_that_happens_to_bear_the_same_stamps_is_not_compared(bag: Path) -> None:
    leave_mapping_drive(bag, Trajectory(STAMPS, TRUTH + 1.0), {"bag": "drive.bag", "bag_fingerprint": "0"})
    assert localize(bag, "--quiet") == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert any("from another drive" in sentence for sentence in report["warnings"])
    assert "against_mapping_trajectory" not in report["accuracy"]
    assert mean_error(bag) < 0.05


@pytest.mark.parametrize(
    ("flags", "advice"),
    [
        (("--initial-pose", "2.2", "2.4", "0.1"), "correct the initial pose."),
        (("--global",), "give the initial pose."),
    ],
)
def test_a_search_that_is_given_up_advises_what_was_not_done(
    bag: Path, flags: tuple[str, ...], advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(DriveJudge, "is_hopeless", property(lambda judge: judge.path_metres > 1.0))
    assert localize(bag, *flags, "--quiet") == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    (sentence,) = [each for each in report["warnings"] if each.startswith("The search ended")]
    assert sentence.endswith(f"Name the map of the place, or {advice}")


def test_strict_fails_unless_the_drive_is_localized(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert localize(bag, "--strict", "--initial-pose", "2", "2.5", "0") == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert report["quality"]["verdict"] == "localized"
    assert report["quality"]["known_share"] == pytest.approx(1.0, abs=0.1)
    assert report["counts"]["path_metres"] == pytest.approx(5.0, abs=0.2)
    assert capsys.readouterr().out.splitlines()[-1].startswith("The drive is localized: ")
    cells = np.full((120, 120), FREE, dtype=np.int8)
    cells[:3], cells[-3:], cells[:, :3], cells[:, -3:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[20:60:4, 20:100:9] = OCCUPIED
    save_map(OccupancyGrid(cells, 0.05, IDENTITY), bag.parent / "map" / "map.yaml")  # of another place
    assert localize(bag, "--strict") == 3
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert report["quality"]["verdict"] in ("lost", "uncertain")
    assert (
        capsys.readouterr().out.splitlines()[-1].startswith(f"The drive is {report['quality']['verdict']}: ")
    )


def test_same_seed_same_bytes(bag: Path) -> None:
    written = []
    for seed in ("3", "3", "4"):
        assert localize(bag, "--global", "--seed", seed, "--quiet") == 0
        written.append((bag.parent / "out" / "trajectory.tum").read_bytes())
    assert written[0] == written[1] != written[2]


@pytest.mark.parametrize(
    ("flags", "complaint"),
    [
        (("--initial-pose", "nan", "0", "0"), "not three finite numbers"),
        (("--initial-pose", "500", "0", "0"), "not on the map's free space"),
        (("--initial-pose", "2", "2", "0", "--global"), "exclude each other"),
    ],
)
def test_impossible_starts_are_one_sentence(
    bag: Path, capsys: pytest.CaptureFixture[str], flags: tuple[str, ...], complaint: str
) -> None:
    assert localize(bag, *flags) == 2
    assert complaint in capsys.readouterr().err
    assert not (bag.parent / "out").exists()


def test_without_odometry_the_report_says_so(bag: Path) -> None:
    assert localize(bag, "--no-odom", "--initial-pose", "2", "2.5", "0") == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert any("No odometry" in sentence for sentence in report["warnings"])
    assert mean_error(bag) < 0.1


def test_a_laser_that_is_covered_at_first_is_no_search(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    covered = bag.with_name("covered.bag")
    write_drive(covered, covered=25)
    assert localize(covered, "--global") == 0
    told = capsys.readouterr()
    assert "In 25 of 40 scans no beam met anything" in told.out + told.err
    assert "searched again" not in told.out + told.err


def change_map(bag: Path, **changes: object) -> None:
    path = bag.parent / "map" / "map.yaml"
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **changes}))


@pytest.mark.parametrize(
    ("changes", "darkest", "complaint"),
    [
        ({"occupied_thresh": 0.9999999}, 60, "The map has no wall"),
        ({"free_thresh": 0.0}, 0, "The map has no free cells"),
    ],
)
def test_a_map_that_tells_nothing_is_refused(
    bag: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, object], darkest: int, complaint: str
) -> None:
    change_map(bag, **changes)
    image = Image.open(bag.parent / "map" / "map.pgm")
    image.point(lambda grey: max(grey, darkest)).save(bag.parent / "map" / "map.pgm")
    assert localize(bag, "--global") == 2
    assert complaint in capsys.readouterr().err
    assert not (bag.parent / "out").exists()


def test_a_map_whose_colours_mean_the_opposite_is_refused(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("building.yaml", "building.pgm"):
        shutil.copy(shipped_map("building").with_name(name), bag.parent / "map")
    arguments = ["--map", str(bag.parent / "map" / "building.yaml"), "--out", str(bag.parent / "out")]
    (bag.parent / "map" / "map.yaml").write_text(
        (bag.parent / "map" / "building.yaml").read_text().replace("negate: 0", "negate: 1")
    )
    assert localize(bag, "--global") == 2
    assert "wall and its floor nowhere wider than 0.10 m" in capsys.readouterr().err
    assert run(["localize", str(bag), *arguments, "--quiet"]) == 0


def test_coarse_cells_are_told(bag: Path) -> None:
    change_map(bag, resolution=0.3)
    assert localize(bag, "--global", "--quiet") == 0
    report = json.loads((bag.parent / "out" / "report.json").read_text())
    assert any("cells are 0.3 m wide" in sentence for sentence in report["warnings"])


@pytest.mark.parametrize("verdict", DriveVerdict)
def test_what_a_lost_car_makes_of_its_odometry_is_not_told(verdict: DriveVerdict) -> None:
    report = Report("racecar localize")
    report.add("counts", {"scans": 10, "path_metres": 1.0})
    report.add("accuracy", {"share_of_end_points_within_0.10_m_of_a_wall": 0.5})
    report.add("update_ms", {"mean": None})
    report.add("odometry_faults", {"distance": -0.18})
    quality = DriveQuality(verdict, 1.0, 0.02, 5.0, (), ())
    is_localized = verdict == DriveVerdict.LOCALIZED
    told = " ".join(summary(report.contents, is_localized=is_localized))
    assert ("18% too long" in told) == is_localized
    assert quality.summary.startswith(f"The drive is {verdict.value}: ")
