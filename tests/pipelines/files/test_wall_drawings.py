"""Walls as vectors: what was drawn is in the files, in metres, the right way up."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import ezdxf
import numpy as np

from racecar.pipelines.files.wall_drawings import save_walls_dxf, save_walls_svg

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0], [0.0, 0.0]])
WALL = np.array([[1.0, -1.5], [2.0, 2.25]])


def test_dxf_has_the_lines_in_metres(tmp_path: Path) -> None:
    save_walls_dxf([SQUARE, WALL], tmp_path / "walls.dxf")
    drawing = ezdxf.readfile(tmp_path / "walls.dxf")
    assert not drawing.audit().errors
    assert drawing.units == ezdxf.units.M
    square, wall = drawing.modelspace().query('LWPOLYLINE[layer=="walls"]')
    assert square.closed
    np.testing.assert_allclose([point[:2] for point in square.get_points()], SQUARE[:-1])
    assert not wall.closed
    np.testing.assert_allclose([point[:2] for point in wall.get_points()], WALL)


def test_svg_shows_all_lines_with_y_up(tmp_path: Path) -> None:
    save_walls_svg([SQUARE, WALL], 0.05, tmp_path / "walls.svg")
    root = ElementTree.parse(tmp_path / "walls.svg").getroot()
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    np.testing.assert_allclose([left, top, width, height], [-0.05, -3.05, 4.1, 4.6])
    assert root.attrib["width"] == "41.000mm"
    lines = [line.attrib["points"] for line in root.iter("{http://www.w3.org/2000/svg}polyline")]
    assert lines[1] == "1.0000,1.5000 2.0000,-2.2500"


def test_a_map_without_walls_is_an_empty_drawing(tmp_path: Path) -> None:
    save_walls_svg([], 0.05, tmp_path / "walls.svg")
    save_walls_dxf([], tmp_path / "walls.dxf")
    assert len(ElementTree.parse(tmp_path / "walls.svg").getroot()[0]) == 0
    assert len(ezdxf.readfile(tmp_path / "walls.dxf").modelspace()) == 0
