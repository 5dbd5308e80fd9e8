"""The walls of a map as vector drawings: SVG for pictures, DXF for CAD."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from racecar.maps.whole_files import write_atomically

_MILLIMETRES = 10.0
"""Millimetres on paper per metre, by definition of the scale 1:100."""
_METRES = 6
"""DXF's number for metres, by definition of $INSUNITS."""


def save_walls_svg(lines: Sequence[NDArray[np.float64]], stroke: float, path: Path) -> None:
    """Write polylines (N, 2) in metres at 1:100, with a ``stroke`` in metres. The unit is a metre, and y
    points down as in every SVG.

    Raises UserError when the file cannot be written.
    """
    points = np.concatenate(lines) if lines else np.zeros((1, 2))
    low, high = points.min(axis=0) - stroke, points.max(axis=0) + stroke
    width, height = high - low
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_MILLIMETRES * width:.3f}mm" '
        f'height="{_MILLIMETRES * height:.3f}mm" '
        f'viewBox="{low[0]:.4f} {-high[1]:.4f} {width:.4f} {height:.4f}">',
        f'<g fill="none" stroke="black" stroke-width="{stroke:g}" stroke-linecap="round" '
        'stroke-linejoin="round">',
        *(f'<polyline points="{" ".join(f"{x:.4f},{-y:.4f}" for x, y in line)}"/>' for line in lines),
        "</g>",
        "</svg>",
    ]
    with write_atomically(path) as partial:
        partial.write_text("\n".join(text) + "\n", encoding="ascii")


def save_walls_dxf(lines: Sequence[NDArray[np.float64]], path: Path) -> None:
    """Write polylines (N, 2) in metres on the layer ``walls``; those that end where they begin are closed.

    Raises UserError when the file cannot be written.
    """
    import ezdxf  # slow to load, and rarely needed

    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = _METRES
    drawing.layers.add("walls")
    for line in lines:
        is_closed = len(line) > 3 and bool(np.array_equal(line[0], line[-1]))
        corners = line[:-1] if is_closed else line
        drawing.modelspace().add_lwpolyline(corners.tolist(), close=is_closed, dxfattribs={"layer": "walls"})
    with write_atomically(path) as partial:
        drawing.saveas(partial)
