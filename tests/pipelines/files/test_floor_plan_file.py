"""The same plan as an image, an SVG and a DXF; and files that are none."""

from pathlib import Path

import ezdxf
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image
from skimage.draw import polygon2mask

from racecar.maps.errors import UserError
from racecar.pipelines.files.floor_plan_file import load_floor_plan

ROOM = np.array([(20, 30), (180, 30), (180, 90), (20, 90)])
"""Corners in pixels, y upwards, of a room in an image of 200 x 120."""


def image(path: Path, *, light_on_dark: bool = False, mode: str = "L", size: int = 1) -> Path:
    """Walls 6 pixels thick around the room."""
    outer = np.clip(ROOM, ROOM.min(axis=0), ROOM.max(axis=0)) + np.where(ROOM.mean(axis=0) < ROOM, 6, -6)
    rows = np.full((120, 200), 255, dtype=np.uint8)
    for corners, shade in ((outer, 0), (ROOM, 255)):
        rows[polygon2mask((120, 200), corners[:, ::-1] - 0.5)] = shade
    pixels = np.kron(rows[::-1], np.ones((size, size), dtype=np.uint8))
    Image.fromarray(255 - pixels if light_on_dark else pixels).convert(mode).save(path)
    return path


@pytest.mark.parametrize("name", ["plan.png", "plan.pgm", "PLAN.JPG"])
@pytest.mark.parametrize("light_on_dark", [False, True])
def test_the_faces_of_walls_in_an_image(tmp_path: Path, name: str, light_on_dark: bool) -> None:
    plan = load_floor_plan(image(tmp_path / name, light_on_dark=light_on_dark))
    middles, lengths = plan.lines.mean(axis=1), np.hypot(*np.diff(plan.lines, axis=1)[:, 0].T)
    west = (plan.faces[:, 0] > 0.9) & (lengths > 20) & (middles[:, 0] < 100)  # which looks into the room
    assert west.any()
    np.testing.assert_allclose(plan.lines[west][..., 0], 20.0, atol=0.75)
    assert plan.unit == "pixel" and plan.metres_per_unit is None and plan.top == 120.0
    np.testing.assert_array_equal(plan.places(np.array([[20.0, 30.0]])), [[20.0, 90.0]])


@pytest.mark.parametrize("mode", ["1", "P", "RGB", "RGBA", "LA", "I;16"])
def test_images_of_all_kinds_of_pixels(tmp_path: Path, mode: str) -> None:
    grey = load_floor_plan(image(tmp_path / "grey.png"))
    if mode == "I;16":
        pixels = np.asarray(Image.open(tmp_path / "grey.png")).astype(np.uint16) * 257
        Image.fromarray(pixels).save(tmp_path / "other.png")
    else:
        image(tmp_path / "other.png", mode=mode)
    np.testing.assert_array_equal(load_floor_plan(tmp_path / "other.png").lines, grey.lines)


def test_transparent_paper_is_white(tmp_path: Path) -> None:
    pixels = np.asarray(Image.open(image(tmp_path / "grey.png")))
    opacity = np.where(pixels == 0, 255, 0).astype(np.uint8)
    Image.fromarray(np.dstack([np.zeros_like(pixels), opacity]), mode="LA").save(tmp_path / "clear.png")
    expected = load_floor_plan(tmp_path / "grey.png").lines
    np.testing.assert_array_equal(load_floor_plan(tmp_path / "clear.png").lines, expected)


def test_a_huge_image_is_read_more_coarsely_in_its_own_pixels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fine = load_floor_plan(image(tmp_path / "fine.png", size=3))
    monkeypatch.setattr("racecar.pipelines.files.floor_plan_image._MOST_PIXELS", 30_000)
    coarse = load_floor_plan(tmp_path / "fine.png")
    assert coarse.darkness is not None and coarse.darkness.size < 30_000
    in_map = [plan.drawn(0.01, 0.01) for plan in (fine, coarse)]
    edges = [grid.center_of(np.argwhere(grid.cells > 50)) for grid in in_map]
    np.testing.assert_allclose(edges[0].min(axis=0), edges[1].min(axis=0), atol=0.05)
    np.testing.assert_allclose(fine.lines.min(axis=(0, 1)), coarse.lines.min(axis=(0, 1)), atol=3.0)


SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="120mm" viewBox="0 -10 20 12">
<defs><rect id="door" width="9" height="9"/><clipPath id="c"><rect width="99" height="9"/></clipPath></defs>
<g transform="translate(2 -7)"><path d="M0 0 h16 v6 h-16 z" fill="none" stroke="black"/></g>
<g style="display:none"><line x1="0" y1="0" x2="90" y2="90" stroke="black"/></g>
<rect width="50" height="50" fill="none" stroke="none"/><text x="3" y="3">Room</text></svg>"""


def test_an_svg_is_read_in_units_of_its_view_box(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    (tmp_path / "plan.svg").write_text(SVG)
    plan = load_floor_plan(tmp_path / "plan.svg", 0.5)
    np.testing.assert_allclose(plan.lines.min(axis=(0, 1)), [2.0, 2.0 - -1.0], atol=1e-4)
    np.testing.assert_allclose(plan.lines.max(axis=(0, 1)), [18.0, 2.0 - -7.0], atol=1e-4)
    assert plan.metres_per_unit == 0.5 and not plan.faces.any()
    np.testing.assert_allclose(plan.places(np.array([[2.0, -7.0]])), [[2.0, 9.0]])


def dxf(path: Path, units: int = 4) -> Path:
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = units
    space = drawing.modelspace()
    space.add_lwpolyline((ROOM * 100).tolist(), close=True)
    wall = drawing.blocks.new("wall")
    wall.add_line((0, 0), (1000, 0))
    space.add_blockref("wall", (5000, 5000), dxfattribs={"rotation": 90})
    space.add_circle((10000, 6000), 500)
    drawing.layers.add("furniture").off()
    space.add_line((0, 0), (90000, 0), dxfattribs={"layer": "furniture"})
    space.add_text("Room", height=90000)
    space.add_linear_dim((0, 90000), (0, 0), (3000, 0)).render()
    drawing.saveas(path)
    return path


@pytest.mark.parametrize(("units", "metres"), [(4, 0.001), (6, 1.0), (1, 0.0254), (0, None)])
def test_a_dxf_is_read_with_its_blocks_and_its_scale(
    tmp_path: Path, units: int, metres: float | None
) -> None:
    plan = load_floor_plan(dxf(tmp_path / "plan.dxf", units))
    assert plan.metres_per_unit == (None if metres is None else pytest.approx(metres))
    np.testing.assert_allclose(plan.lines.min(axis=(0, 1)), ROOM.min(axis=0) * 100, atol=1e-6)
    np.testing.assert_allclose(plan.lines.max(axis=(0, 1)), ROOM.max(axis=0) * 100, atol=1e-6)
    in_block = np.array([[[5000.0, 5000.0], [5000.0, 6000.0]]])
    assert np.isclose(plan.lines, in_block).all(axis=(1, 2)).any()
    around = np.hypot(*(plan.lines[:, 0] - [10000, 6000]).T)
    assert np.isclose(around, 500.0, atol=0.5).sum() >= 32
    np.testing.assert_array_equal(plan.places(np.array([[1.0, 2.0]])), [[1.0, 2.0]])


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("plan.png", b"", "cannot be read"),
        ("plan.png", b"hello", "cannot be read"),
        ("plan", b"hello", "cannot be read"),
        ("plan.dxf", b"hello", "cannot be read as a DXF"),
        ("plan.dxf", b"", "shows no lines"),
        ("plan.dwg", b"AC1032", "is a DWG: save"),
        ("plan.pdf", b"%PDF-1.4", "is a PDF: save"),
        ("plan.svg", b"", "cannot be read as an SVG"),
        ("plan.svg", b"<html></html>", "cannot be read as an SVG"),
        (
            "plan.svg",
            b'<svg xmlns="http://www.w3.org/2000/svg"><g id="a"><use href="#a"/></g></svg>',
            "cannot",
        ),
        ("plan.svg", b'<svg xmlns="http://www.w3.org/2000/svg"></svg>', "shows no lines"),
    ],
)
def test_what_is_no_plan(tmp_path: Path, name: str, content: bytes, why: str) -> None:
    if name.endswith("svg"):
        pytest.importorskip("svgelements")
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=why) as error:
        load_floor_plan(tmp_path / name)
    assert "\n" not in str(error.value)


def test_a_blank_page_and_no_file(tmp_path: Path) -> None:
    Image.new("L", (50, 50), 255).save(tmp_path / "plan.png")
    with pytest.raises(UserError, match="shows no lines"):
        load_floor_plan(tmp_path / "plan.png")
    with pytest.raises(UserError, match="There is no floor plan"):
        load_floor_plan(tmp_path / "other.png")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
@pytest.mark.parametrize("kind", ["png", "dxf", "svg"])
def test_damage_is_a_plan_or_a_sentence(tmp_path: Path, kind: str, data: st.DataObject) -> None:
    if kind == "svg":
        pytest.importorskip("svgelements")
        whole = SVG.encode()
    else:
        source = tmp_path / f"whole.{kind}"
        if not source.exists():
            image(source) if kind == "png" else dxf(source)
        whole = source.read_bytes()
    at = data.draw(st.integers(0, len(whole) - 1))
    changed = data.draw(st.binary(max_size=8))
    cut = data.draw(st.booleans())
    damaged = tmp_path / f"damaged.{kind}"
    damaged.write_bytes(whole[:at] + changed + (b"" if cut else whole[at + len(changed) :]))
    try:
        plan = load_floor_plan(damaged)
    except UserError:
        return
    assert len(plan.lines) and np.isfinite(plan.lines).all()
