"""The layers drawn over the floor, each with a name."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from viser import PointCloudHandle, ViserServer

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
)
from racecar.pipelines.studio.simplified_line import corners_of_line


class Layer(NamedTuple):
    """How a named thing is drawn."""

    color: Color
    words: str = ""
    """Text in the legend; empty if it needs no explanation."""
    width: float = 2.0
    """Pixels: the thickness of a line, the diameter of a dot."""


LAYERS = {
    "floor_plan": Layer(SKY, "floor plan", 2.0),
    "keyframes": Layer(SKY, "keyframe", 7.0),
    "path": Layer(PATH, "path", 4.0),
    "driven": Layer(TRUTH, "path", 3.0),
    "matches": Layer(SKY, "match"),
    "planned": Layer(SKY, "planned way"),
    "loops": Layer(LOOP, "loop closure"),
    "doubts": Layer(LOOP, "doubtful place (cross)", 4.0),
    "walkers": Layer(LOOP, "walker", 7.0),
    "truth": Layer(TRUTH, "car, as it is", 4.0),
    "scan": Layer(SCAN, "scan", 6.0),
    "first_pass": Layer(PATH, "first pass", 7.0),
    "second_pass": Layer(SCAN, "second pass", 7.0),
    "course": Layer(SKY, "the course's filter", 1.5),
    "particles": Layer(PARTICLE, "particle, with its heading", 1.5),
    "ellipse": Layer(CAR),
    "car": Layer(CAR, "car, as estimated", 5.0),
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
_ARROW = 0.15
"""Metres of a pose's arrow. Chosen by judgement: visible beside a car, yet many stay distinguishable."""
_HEIGHTS = {name: number * _STEP for number, name in enumerate(LAYERS, start=1)}
_LEAST_WALL, _LEAST_CAR = 3.0, 34.0
"""Pixels: a wall's width and a car's length from farther away, to be seen from the back of a room."""
_CAR_LENGTH = 0.6
"""Metres of the drawn car."""
_DOT = 0.5
"""Size of a dot, as viser takes it, over its diameter."""
_ZOOMED = 1.3
"""Factor by which a view is zoomed before it is drawn again."""


class Entry(NamedTuple):
    """A line of the legend."""

    words: str
    colors: tuple[Color, ...]
    """One colour, or a scale."""


class Layers:
    """A drawing; not safe for use by several threads at once."""

    def __init__(
        self, server: ViserServer, show_legend: Callable[[Sequence[Entry]], None], root: str = ""
    ) -> None:
        """``root`` is the scene node to draw on; ``show_legend`` receives the entries of what is visible."""
        self._scene, self._root, self._tell_legend = server.scene, root, show_legend
        self._ground = LIGHT
        self._pixel = 0.05
        """Metres of a pixel."""
        self._handles: dict[str, Any] = {}
        self._entries: dict[str, Entry] = {}
        """Legend entries of the visible layers."""
        self._lines: dict[str, tuple[NDArray[np.float64], Shades | None]] = {}
        """Lines before they were simplified."""
        self._hidden: set[str] = set()
        self._painted: tuple[Raster, Sequence[tuple[Raster, Color]]] | None = None
        self._size = 0.0, 0.0

    @property
    def car_scale(self) -> float:
        """Factor by which a car is drawn larger than it is, to be seen."""
        return max(1.0, _LEAST_CAR * self._pixel / _CAR_LENGTH)

    def begin_anew(self) -> None:
        """Remove everything, and make all layers visible again."""
        self.clear("map", *LAYERS)
        self._hidden.clear()
        self._painted = None

    def fit(self, pixel: float) -> bool:
        """Draw for a view whose pixels are ``pixel`` metres wide; returns whether that has changed much."""
        if max(pixel, self._pixel) < _ZOOMED * min(pixel, self._pixel):
            return False
        self._pixel = pixel
        self._paint()
        for name, line in list(self._lines.items()):
            self.line(name, *line)
        for name, handle in self._handles.items():
            if isinstance(handle, PointCloudHandle):
                handle.point_size = _DOT * LAYERS[name].width * pixel
        return True

    def lie_on(self, ground: Backdrop) -> None:
        """Paint the map on this background from now on."""
        self._ground = ground
        self._paint()

    def map(self, grid: Raster, tints: Sequence[tuple[Raster, Color]] = ()) -> None:
        """Draw the floor: a grid, with ``tints`` as in `paint`."""
        self._painted = grid, tints
        self._paint()

    def _paint(self) -> None:
        if self._painted is None:
            return
        grid, tints = self._painted
        image = paint(grid, self._ground, tints, pixel=self._pixel, least_wall=_LEAST_WALL)
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
        self._handles["map"] = self._scene.add_image(
            f"{self._root}/map",
            image.pixels,
            *image.size,
            format="png",
            cast_shadow=False,
            receive_shadow=False,
            **place,
        )

    def segments(self, name: str, ends: NDArray[np.float64], shades: Shades | None = None) -> None:
        """Draw lines between ends (N, 2, 2), in the layer's colour or in shades; without any, the layer is
        removed."""
        if len(ends) == 0:
            self.clear(name)
            return
        layer, handle = LAYERS[name], self._handles.get(name)
        points, colors = _lifted(ends, name), np.array(layer.color, dtype=np.uint8)
        if shades is not None:
            colors = np.repeat(shades.colors[:, None], 2, axis=1)
        if handle is not None and np.array_equal(handle.colors, colors):
            if not np.array_equal(handle.points, points):
                handle.points = points
            return
        self._handles[name] = self._scene.add_line_segments(
            f"{self._root}/{name}",
            points,
            colors,
            thickness=layer.width,
            thickness_units="screen",
            visible=name not in self._hidden,
        )
        self._enter(name, Entry(layer.words, (layer.color,)) if shades is None else Entry(*shades[:2]))

    def line(self, name: str, points: NDArray[np.float64], shades: Shades | None = None) -> None:
        """Draw a line through points (N, 2), optionally in N - 1 shades; a single point draws nothing."""
        line = points, shades
        if len(points) > 2:
            kept = corners_of_line(points, None if shades is None else shades.shares, self._pixel)
            points = points[kept]
            shades = None if shades is None else shades._replace(shares=shades.shares[kept[:-1]])
        self.segments(name, np.stack([points[:-1], points[1:]], axis=1), shades)
        self._lines[name] = line

    def dots(self, name: str, points: NDArray[np.float64]) -> None:
        """Draw dots at points (N, 2)."""
        if len(points) == 0:
            self.clear(name)
            return
        layer, handle = LAYERS[name], self._handles.get(name)
        if handle is not None:
            handle.points = _lifted(points, name)
            return
        self._handles[name] = self._scene.add_point_cloud(
            f"{self._root}/{name}",
            _lifted(points, name),
            layer.color,
            point_size=_DOT * layer.width * self._pixel,
            point_shape="circle",
            precision="float32",
            visible=name not in self._hidden,
        )
        self._enter(name, Entry(layer.words, (layer.color,)))

    def arrows(self, name: str, poses: Pose) -> None:
        """Draw short lines from poses (N, 3) in the direction of their headings."""
        ahead = _ARROW * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        self.segments(name, np.stack([poses[:, :2], poses[:, :2] + ahead], axis=1))

    def explain(self, name: str, words: str) -> None:
        """Have the legend say something else of a drawn layer."""
        if name in self._entries:
            self._entries[name] = self._entries[name]._replace(words=words)
            self._show_legend()

    def clear(self, *names: str) -> None:
        """Remove layers."""
        for name in names:
            self._lines.pop(name, None)
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

    def _enter(self, name: str, entry: Entry) -> None:
        self._entries[name] = entry
        self._show_legend()

    def _show_legend(self) -> None:
        are_shown = self._entries.keys() - self._hidden
        self._tell_legend([self._entries[name] for name in LAYERS if name in are_shown])


def _lifted(places: NDArray[np.float64], name: str) -> NDArray[np.float32]:
    """Places (..., 2) at the height of their layer, (..., 3)."""
    heights = np.full((*places.shape[:-1], 1), _HEIGHTS[name])
    return np.concatenate([places, heights], axis=-1).astype(np.float32)
