"""A floor plan laid under the map of a run, through the command and later renderings."""

import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from PIL import Image

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.commands.floor_plan_options import PlanFlags
from racecar.pipelines.files.edits_file import EDITS_FILE, load_edits
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session, save_session
from racecar.pipelines.files.tum import load_tum, save_tum
from tests.end_to_end.commands import in_this_process
from tests.mapping.sessions import RING, path, session

WORLD = path(0.0, 34.0)
PLAN_FROM_WORLD = np.array([20.0, 10.0, math.radians(30.0)])
"""In metres as they are; the plan is drawn 3 % too large, at 1 mm per unit."""
DRAWN = 1000.0 * 1.03
"""Units per metre."""
CORNER = np.array([10.0, 7.0])
"""Metres from the lower left corner of an image to the middle of the hall."""
POINTS = np.array([(-6.0, -4.0), (6.0, 4.0)])


@pytest.fixture
def run(tmp_path: Path) -> Path:
    drive = session(RING, WORLD, np.array([1.0, 2.0, 0.3]), np.array([0.2, 0.0, 0.0]))
    folder = tmp_path / "run"
    folder.mkdir()
    save_session(drive, folder / "session.npz")
    save_tum(Trajectory(drive.times.stamps, drive.map_from_base), folder / "trajectory.tum")
    (folder / EDITS_FILE).write_text("# a chair\n- erase: [[1.0, 2.0], [1.5, 2.0], [1.5, 2.5]]\n")
    return folder


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = 4
    for wall in RING:
        drawing.modelspace().add_line(*(DRAWN * transform_points(PLAN_FROM_WORLD, wall)).tolist())
    drawing.saveas(tmp_path / "plan.dxf")
    return tmp_path / "plan.dxf"


def points(beside: float = 0.1) -> list[str]:
    in_plan = DRAWN * transform_points(PLAN_FROM_WORLD, POINTS)
    in_map = transform_points(np.array([1.0, 2.0, 0.3]), POINTS) + beside
    return [f"{px} {py} {x} {y}" for (px, py), (x, y) in zip(in_plan, in_map, strict=True)]


def flags(beside: float = 0.1) -> list[str]:
    return [word for point in points(beside) for word in ("--plan-point", point)]


def laid(run: Path, out: Path, plan: Path, words: list[str], code: int = 0) -> str:
    """What the command says."""
    done = in_this_process("render", run, "--out", out, "--plan", plan, *words, code=code)
    return done.stdout + done.stderr


def right() -> Pose:
    base_from_laser = np.array([0.2, 0.0, 0.0])
    return compose(compose(PLAN_FROM_WORLD, WORLD), inverse(base_from_laser))


def test_the_map_gets_the_frame_of_the_plan_and_keeps_it(run: Path, plan: Path, tmp_path: Path) -> None:
    out, again = tmp_path / "out", tmp_path / "again"
    told = laid(run, out, plan, flags())
    assert "of the map's walls lie on those of plan.dxf" in told
    assert "it is drawn 3.0 % too large" in told
    found = load_session(out).map_from_base
    assert np.hypot(*(found - right())[:, :2].T).max() < 0.03
    assert np.abs(found - right())[:, 2].max() < math.radians(0.2)
    assert load_session(out).is_of(load_tum(out / "trajectory.tum"))
    edits = load_edits(out / EDITS_FILE)
    assert len(edits.edits) == 1 and len(edits.constraints) == 3
    in_world = transform_points(inverse(np.array([1.0, 2.0, 0.3])), [[1.0, 2.0]])
    np.testing.assert_allclose(
        edits.edits[0].points[0], transform_points(PLAN_FROM_WORLD, in_world)[0], atol=0.05
    )
    assert (out / "map.png").is_file()

    in_this_process("render", out, "--out", again)
    assert (again / "map.pgm").read_bytes() == (out / "map.pgm").read_bytes()
    assert (again / "floor_plan.yaml").read_bytes() == (out / "floor_plan.yaml").read_bytes()
    assert read_report(again).damage == ""


def test_the_plan_lies_under_the_walls_and_turns_with_the_map(run: Path, plan: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    laid(run, out, plan, flags())
    turned = tmp_path / "turned"
    in_this_process("render", out, "--out", turned, "--turn", 0.7)
    for folder in (out, turned):
        drawn, seen = load_map(folder / "floor_plan.yaml"), load_map(folder)
        lines = drawn.center_of(np.argwhere(drawn.cells > 50))
        walls = seen.center_of(np.argwhere(seen.cells > 50))
        apart = [np.hypot(*(lines - wall).T).min() for wall in walls]
        assert np.quantile(apart, 0.9) < 0.1


def test_without_its_constraints_the_map_lies_on_no_plan(run: Path, plan: Path, tmp_path: Path) -> None:
    out, free = tmp_path / "out", tmp_path / "free"
    laid(run, out, plan, flags())
    edits = load_edits(out / EDITS_FILE)
    for entry in edits.constraints:
        edits = edits.without(entry)
    (out / EDITS_FILE).write_text(edits.text)
    in_this_process("render", out, "--out", free)
    assert not (free / "floor_plan.yaml").exists()


def test_another_plan_replaces_the_first(run: Path, plan: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    laid(run, run, plan, [*flags(), "--replace"])
    in_plan = DRAWN * transform_points(PLAN_FROM_WORLD, POINTS)
    again = [
        word
        for (px, py), (x, y) in zip(in_plan, transform_points(PLAN_FROM_WORLD, POINTS), strict=True)
        for word in ("--plan-point", f"{px} {py} {x} {y}")
    ]
    laid(run, out, plan, again)
    assert len(load_edits(out / EDITS_FILE).constraints) == 3
    assert np.hypot(*(load_session(out).map_from_base - right())[:, :2].T).max() < 0.03


def test_an_image_without_a_scale_says_what_a_pixel_is(run: Path, tmp_path: Path) -> None:
    from skimage.draw import line

    pixels = np.full((700, 1000), 255, dtype=np.uint8)
    for wall in RING:
        (x0, y0), (x1, y1) = np.rint((wall + CORNER) * 50.0).astype(int).tolist()
        rows, columns = line(699 - y0, x0, 699 - y1, x1)
        pixels[rows, columns] = 0
    Image.fromarray(pixels).save(tmp_path / "plan.png")
    in_map = transform_points(np.array([1.0, 2.0, 0.3]), POINTS)
    clicked = (POINTS + CORNER) * 50.0
    words = [
        word
        for (px, py), (x, y) in zip(clicked, in_map, strict=True)
        for word in ("--plan-point", f"{px} {700 - py} {x} {y}")
    ]
    out = tmp_path / "out"
    assert "one pixel is 20 mm" in laid(run, out, tmp_path / "plan.png", words)
    placed = compose(np.array([10.0, 7.0, 0.0]), compose(WORLD, inverse(np.array([0.2, 0.0, 0.0]))))
    assert np.hypot(*(load_session(out).map_from_base - placed)[:, :2].T).max() < 0.05
    assert load_map(out / "floor_plan.yaml").resolution == pytest.approx(0.02, rel=0.005)


def test_a_plan_that_does_not_fit_leaves_the_run_as_it_was(run: Path, plan: Path) -> None:
    before = (run / "session.npz").read_bytes()
    told = laid(run, run, plan, [*flags(beside=4.0), "--replace"], code=2)
    assert "of the map's walls lie on those of plan.dxf: check the points" in told
    assert (run / "session.npz").read_bytes() == before


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"plan_point": ["0 0 1 1"]}, "name it by --plan"),
        ({"plan_scale": 0.1}, "name it by --plan"),
        ({"plan": Path("plan.png")}, "there are 0"),
        ({"plan": Path("plan.png"), "plan_point": ["0 0 1 1"]}, "there are 1"),
        ({"plan": Path("plan.png"), "plan_point": ["0 0 1 1", "0 5 1"]}, "'0 5 1' is none"),
        ({"plan": Path("plan.png"), "plan_point": ["0 0 1 1", "5 5 5 nan"]}, "is none"),
        ({"plan": Path("plan.png"), "plan_point": ["0 0 1 1", "5 5 5 5"], "plan_scale": 0.0}, "no scale"),
    ],
)
def test_flags_that_do_not_go_together(given: dict[str, object], why: str) -> None:
    with pytest.raises(UserError, match=why):
        _ = PlanFlags(**given).requested  # type: ignore[arg-type]
