"""``racecar evaluate``: one trajectory or several, with a picture, and what it warns of."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from racecar.maps.geometry.se2 import wrap_angle
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.map_files import save_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.messages import POSE
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.evaluation import error_picture as module
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.sensors.odometry import Odometry
from tests.pipelines.bag_samples import write_bag

STAMPS = np.arange(400) * 25_000_000 + 10**9
ANGLE = np.linspace(0, 2 * np.pi, len(STAMPS))
TRUTH = np.column_stack([3 * np.cos(ANGLE), 3 * np.sin(ANGLE), wrap_angle(ANGLE + np.pi / 2)])


def leave(path: Path, error: float, rows: slice = slice(None)) -> Path:
    """A trajectory that is off alternately to both sides, which no alignment takes out."""
    poses = TRUTH.copy()
    poses[:, :2] *= 1 + error / 3 * np.where(np.arange(len(poses)) % 2, 1.0, -1.0)[:, None]
    path.parent.mkdir(exist_ok=True)
    save_tum(Trajectory(STAMPS[rows], poses[rows]), path)
    return path


@pytest.fixture
def reference(tmp_path: Path) -> Path:
    return leave(tmp_path / "truth.tum", 0.0)


def test_several_are_in_one_table(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [leave(tmp_path / name / "trajectory.tum", error) for name, error in (("a", 0.02), ("b", 0.05))]
    figures = tmp_path / "figures.json"
    arguments = [*map(str, runs), "--reference", str(reference), "--json", str(figures)]
    assert run(["evaluate", *arguments]) == 0
    shown = capsys.readouterr().out
    assert f"2 trajectories against {reference}" in shown
    rows = [next(line for line in shown.splitlines() if str(path) in line) for path in runs]
    assert [float(row.split("│")[2]) for row in rows] == pytest.approx([0.02, 0.05], abs=1e-3)
    assert all("100.0%" in row for row in rows)
    written = json.loads(figures.read_text())
    assert [each["trajectory"] for each in written["trajectories"]] == [str(path) for path in runs]
    assert written["warnings"] == []
    assert shown.splitlines()[-1] == f"The figures are in {figures}."


@pytest.mark.parametrize(("covered", "warned"), [(350, True), (380, False)])
def test_a_reference_that_covers_less_than_nine_tenths_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], covered: int, warned: bool
) -> None:
    path = leave(tmp_path / "poses.tum", 0.02)
    reference = leave(tmp_path / "truth.tum", 0.0, slice(covered))
    figures = tmp_path / "figures.json"
    assert run(["evaluate", str(path), "--reference", str(reference), "--json", str(figures)]) == 0
    said = capsys.readouterr().err
    assert (f"covers only 88% of the poses of {path}" in said) == warned
    assert len(json.loads(figures.read_text())["warnings"]) == warned


def test_the_plot_shows_errors_on_the_map_and_over_time(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = []
    picture = module.error_picture
    monkeypatch.setattr(module, "error_picture", lambda paths: drawn.append(paths) or picture(paths))
    cells = np.full((160, 160), FREE, dtype=np.int8)
    cells[[0, -1]] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, np.array([-4.0, -4.0, 0.0]))
    beside, named, without = (leave(tmp_path / name / "trajectory.tum", 0.02) for name in "abc")
    save_map(grid, beside.parent / "map.yaml")
    report = {"inputs": {"map": str(beside.parent)}}
    (named.parent / "report.json").write_text(json.dumps(report))
    plot = tmp_path / "errors.png"
    arguments = [str(beside), str(named), str(without), "--reference", str(reference), "--plot", str(plot)]
    assert run(["evaluate", *arguments]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"Look at {plot}."
    assert [path.grid is not None for path in drawn[0]] == [True, True, False]
    assert drawn[0][0].errors.seconds[-1] == pytest.approx(399 * 0.025)
    np.testing.assert_allclose(drawn[0][0].errors.positions, 0.02, atol=2e-3)
    assert min(Image.open(plot).size) > 1000
    assert run(["evaluate", *arguments, "--map", str(beside.parent), "--quiet"]) == 0
    assert [path.grid is not None for path in drawn[1]] == [True, True, True]


def test_the_colour_grows_with_the_error(reference: Path) -> None:
    colored = module.error_picture([drifting("run")]).axes[0].collections[0]
    assert np.all(np.diff(np.asarray(colored.get_array())) > 0)
    assert colored.get_clim() == (0.0, pytest.approx(0.099, abs=1e-3))


@pytest.mark.parametrize("count", [1, 3])
def test_the_reference_is_drawn_beside_each_run_and_among_all(count: int) -> None:
    figure = module.error_picture([drifting(f"run {number}") for number in range(count)])
    panels = [axes for axes in figure.axes if axes.get_xlabel() == "x (m)"]
    assert len(panels) == (1 if count == 1 else count + 1)
    for axes in panels:
        (reference,) = (line for line in axes.lines if line.get_label() == "reference")
        np.testing.assert_allclose(np.transpose(reference.get_data()), TRUTH[:, :2], atol=0.1)
    if count > 1:
        colors = {line.get_color() for line in panels[-1].lines}
        assert len(colors) == count + 1


def drifting(name: str) -> module.MeasuredPath:
    """A run whose error grows to a decimetre."""
    errors = compare(Trajectory(STAMPS, TRUTH), Trajectory(STAMPS, TRUTH))
    return module.MeasuredPath(name, replace(errors, positions=np.linspace(0.0, 0.1, len(STAMPS))))


@pytest.mark.parametrize(
    ("flags", "complaint"),
    [
        (["--map", "track"], "give both, or neither"),
        (["--plot", "errors.png", "--map", "nowhere"], "no map at nowhere"),
    ],
)
def test_mistakes(
    reference: Path, flags: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["evaluate", str(reference), "--reference", str(reference), *flags]) == 2
    assert complaint in capsys.readouterr().err


def test_poses_come_from_csv_files_and_topics_of_bags(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "drive.bag"
    with BagWriter(bag) as writer:
        for stamp, pose in zip(STAMPS.tolist(), TRUTH, strict=True):
            writer.write_odometry(Odometry(stamp, pose, np.zeros(3)), topic="/pf/pose/odom")
            message = writer._messages.path("map", [stamp], pose[None]).poses[0]
            writer.write_message("/mocap", POSE, message, stamp)
    table = tmp_path / "truth.csv"
    rows = np.column_stack([STAMPS * 1e-9, TRUTH])
    np.savetxt(table, rows, delimiter=",", header="t,x,y,yaw", comments="")
    figures = tmp_path / "figures.json"
    names = [str(reference), str(table), f"{bag}:/pf/pose/odom", f"{bag}:/mocap"]
    for true in names:
        assert run(["evaluate", *names, "--reference", true, "--json", str(figures)]) == 0
        for each in json.loads(figures.read_text())["trajectories"]:
            assert each["absolute_position_m"]["max"] < 1e-6
    assert "Warning" not in capsys.readouterr().err


def test_messages_without_a_pose_are_warned_of(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "drive"
    with BagWriter(bag) as writer:
        for index, (stamp, pose) in enumerate(zip(STAMPS.tolist(), TRUTH, strict=True)):
            usable = pose if index % 20 else np.array([np.nan, 0.0, 0.0])
            writer.write_odometry(Odometry(stamp, usable, np.zeros(3)), topic="/odom")
            writer.write_odometry(Odometry(stamp, np.full(3, np.nan), np.zeros(3)), topic="/lost")
    assert run(["evaluate", f"{bag}:/odom", "--reference", str(reference)]) == 0
    assert f"{bag}:/odom: Messages dropped because they hold no valid pose: 20." in capsys.readouterr().err
    assert run(["evaluate", str(reference), "--reference", f"{bag}:/lost"]) == 2
    assert "/lost" in (said := capsys.readouterr().err) and "holds no usable pose. Messages dropped" in said


@pytest.mark.parametrize(
    ("topic", "complaint"),
    [
        ("", "Name their topic, as in {bag}:/odom; its topics of poses: /odom."),
        (":/pose", "There is no topic /pose in the bag"),
        (":/scan", "holds sensor_msgs/msg/LaserScan, not poses; topics that do: /odom."),
    ],
)
def test_a_bag_needs_a_topic_of_poses(
    tmp_path: Path, reference: Path, topic: str, complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "drive.bag", 5)
    assert run(["evaluate", f"{bag}{topic}", "--reference", str(reference)]) == 2
    assert complaint.format(bag=bag) in capsys.readouterr().err
    without = write_bag(tmp_path / "scans.bag", 5, with_odometry=False)
    assert run(["evaluate", str(without), "--reference", str(reference)]) == 2
    assert "has no topic of poses" in capsys.readouterr().err
    assert run(["evaluate", "nowhere.bag:/odom", "--reference", str(reference)]) == 2
    assert "nowhere.bag does not exist" in capsys.readouterr().err


def test_of_several_the_one_at_fault_is_named(
    tmp_path: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = tmp_path / "late.tum"
    save_tum(Trajectory(STAMPS + 10**12, TRUTH), late)
    assert run(["evaluate", str(reference), str(late), "--reference", str(reference)]) == 2
    assert f"{late}: The trajectory and the reference have no time in common" in capsys.readouterr().err
