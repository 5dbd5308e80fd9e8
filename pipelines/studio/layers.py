"""The layers drawn over the floor, each with a name, and the legend."""

from collections.abc import Sequence
from html import escape
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.raster import Raster
from racecar.pipelines.studio.map_image import paint
from racecar.pipelines.studio.palette import (
    CAR,
    LIGHT,
    LOOP,
    PARTICLE,
    PATH,
    SCAN,
    SKY,
    TRUTH,
    Backdrop,
    Color,
    Shades,
    as_css,
)


class Layer(NamedTuple):
    """How a named thing is drawn."""

    color: Color
    words: str = ""
    """Text in the legend; empty if it needs no explanation."""
    width: float = 2.0
    """Pixels: the thickness of a line, the diameter of a dot."""


LAYERS = {
    "keyframes": Layer(SKY, "keyframe", 6.0),
    "path": Layer(PATH, "path", 3.0),
    "matches": Layer(SKY, "match"),
    "planned": Layer(SKY, "planned way"),
    "loops": Layer(LOOP, "loop closure"),
    "doubts": Layer(LOOP, "doubtful place (cross)", 4.0),
    "walkers": Layer(LOOP, "walker", 7.0),
    "truth": Layer(TRUTH, "car, as it is", 4.0),
    "scan": Layer(SCAN, "scan", 3.0),
    "course": Layer(SKY, "the course's filter", 1.5),
    "particles": Layer(PARTICLE, "particle, with its heading", 1.5),
    "ellipse": Layer(CAR),
    "car": Layer(CAR, "car, as estimated", 4.0),
    "goal": Layer(LOOP, "goal", 4.0),
    "drag": Layer(LOOP, "", 4.0),
    "erase": Layer(CAR, "erase"),
    "wall": Layer(PARTICLE, "wall"),
    "free": Layer(SKY, "free"),
    "unknown": Layer(TRUTH, "unknown"),
    "keepout": Layer(LOOP, "keep out"),
    "speed": Layer(SCAN, "speed limit"),
    "chosen": Layer(PATH, "chosen", 5.0),
    "drawn": Layer(PATH, "", 3.0),
    "corners": Layer(PATH, "being drawn", 9.0),
}
"""In ascending order of height, all above the map."""
_STEP = 0.001
"""Metres between layers: enough for the upper ones to hide the lower ones, too little to show parallax."""
_DOT = 0.002
"""Length in metres of the line that draws a dot, since only lines keep their thickness when zooming."""
_ARROW = 0.15
"""Metres of a pose's arrow. Chosen by judgement: visible beside a car, yet many stay distinguishable."""
_HEIGHTS = {name: number * _STEP for number, name in enumerate(LAYERS, start=1)}


class Entry(NamedTuple):
    """A line of the legend."""

    words: str
    colors: tuple[Color, ...]
    """One colour, or a scale."""


class Layers:
    """The drawing; not safe for use by several threads at once."""

    def __init__(self, server: ViserServer) -> None:
        self._scene = server.scene
        self._legend = server.gui.add_html("", order=1e9)
        self._ground = LIGHT
        self._handles: dict[str, Any] = {}
        self._entries: dict[str, Entry] = {}
        """Legend entries of the visible layers."""
        self._hidden: set[str] = set()
        self._painted: tuple[Raster, Sequence[tuple[Raster, Color]]] | None = None
        self._size = 0.0, 0.0

    def begin_anew(self) -> None:
        """Remove everything, and make all layers visible again."""
        self.clear("map", *LAYERS)
        self._hidden.clear()
        self._painted = None

    def map(self, grid: Raster, tints: Sequence[tuple[Raster, Color]] = ()) -> None:
        """Draw the floor: a grid, with ``tints`` as in `paint`."""
        self._painted = grid, tints
        image = paint(grid, self._ground, tints)
        x, y, yaw = image.map_from_middle
        place: dict[str, Any] = {
            "position": (float(x), float(y), 0.0),
            "wxyz": (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2))),
        }
        handle = self._handles.get("map")
        if handle is not None and self._size == image.size:
            handle.image, handle.position, handle.wxyz = image.pixels, place["position"], place["wxyz"]
            return
        self._size = image.size
        self._handles["map"] = self._scene.add_image("/map", image.pixels, *image.size, format="png", **place)

    def lie_on(self, ground: Backdrop) -> None:
        """Paint the map on this background from now on."""
        self._ground = ground
        if self._painted is not None:
            self.map(*self._painted)

    def segments(self, name: str, ends: NDArray[np.float64], shades: Shades | None = None) -> None:
        """Draw lines between ends (N, 2, 2), in the layer's colour or in shades; without any, the layer is
        removed."""
        if len(ends) == 0:
            self.clear(name)
            return
        layer, handle = LAYERS[name], self._handles.get(name)
        heights = np.full((*ends.shape[:2], 1), _HEIGHTS[name])
        points = np.concatenate([ends, heights], axis=2).astype(np.float32)
        colors = np.array(layer.color, dtype=np.uint8)
        if shades is not None:
            colors = np.repeat(shades.colors[:, None], 2, axis=1)
        if handle is not None and np.array_equal(handle.colors, colors):
            if not np.array_equal(handle.points, points):
                handle.points = points
            return
        self._handles[name] = self._scene.add_line_segments(
            f"/{name}",
            points,
            colors,
            thickness=layer.width,
            thickness_units="screen",
            visible=name not in self._hidden,
        )
        self._entries[name] = Entry(layer.words, (layer.color,)) if shades is None else Entry(*shades[:2])
        self._show_legend()

    def line(self, name: str, points: NDArray[np.float64], shades: Shades | None = None) -> None:
        """Draw a line through points (N, 2), optionally in N - 1 shades; a single point draws nothing."""
        self.segments(name, np.stack([points[:-1], points[1:]], axis=1), shades)

    def dots(self, name: str, points: NDArray[np.float64]) -> None:
        """Draw dots at points (N, 2)."""
        self.segments(name, np.stack([points, points + np.array([_DOT, 0.0])], axis=1))

    def arrows(self, name: str, poses: Pose) -> None:
        """Draw short lines from poses (N, 3) in the direction of their headings."""
        ahead = _ARROW * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        self.segments(name, np.stack([poses[:, :2], poses[:, :2] + ahead], axis=1))

    def clear(self, *names: str) -> None:
        """Remove layers."""
        for name in names:
            if name in self._handles:
                self._handles.pop(name).remove()
                self._entries.pop(name, None)
                self._show_legend()

    def show(self, name: str, *, is_wanted: bool) -> None:
        """Show or hide a layer, now and whenever it is drawn again."""
        self._hidden.discard(name)
        if not is_wanted:
            self._hidden.add(name)
        if name in self._handles:
            self._handles[name].visible = is_wanted
        self._show_legend()

    def _show_legend(self) -> None:
        shown = [self._entries[name] for name in LAYERS if name in self._entries.keys() - self._hidden]
        content = legend(shown)
        if self._legend.content != content:
            self._legend.content = content


def legend(entries: Sequence[Entry]) -> str:
    """At the lower left of every page, above the scale bar; entries without words are omitted."""
    rows = "".join(
        f'<div style="display:flex; align-items:center; gap:8px"><span style="width:22px; height:6px; '
        f'border-radius:3px; background:{_background(entry.colors)}"></span>{escape(entry.words)}</div>'
        for entry in entries
        if entry.words
    )
    return rows and (
        '<div data-testid="legend" style="position:fixed; left:16px; bottom:60px; z-index:5; '
        "pointer-events:none; font:13px/1.5 sans-serif; padding:6px 10px; border-radius:6px; "
        f'color:#1b1f24; background:rgba(255,255,255,0.85)">{rows}</div>'
    )


def _background(colors: tuple[Color, ...]) -> str:
    names = [as_css(color) for color in colors]
    return names[0] if len(names) == 1 else f"linear-gradient(90deg, {', '.join(names)})"
