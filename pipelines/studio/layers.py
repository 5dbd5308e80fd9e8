"""What is drawn over the floor: the map, lines, dots and words, each under a name, the later kinds on top."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.edits import EDIT_KINDS
from racecar.pipelines.studio.map_image import MapImage
from racecar.pipelines.studio.palette import Color

STEP = 0.001
"""Metres from layer to layer, so that the upper ones hide the lower ones and none seems to lie elsewhere."""
ORDER = (
    *("map", "covered", "doubt", "path", "matches", "planned", "loops", "keyframes", "mark", "truth", "scan"),
    *("course", "particles", "ellipse", "car", "goal", "drag"),
    *(*EDIT_KINDS, "chosen", "drawn", "corners"),
)
"""The names of the layers, from the lowest to the highest."""
_DOT = 0.002
"""Metres: the length of the line as which a dot is drawn; only lines keep their thickness when one zooms."""


class Layers:
    """The drawing; may be called by one thread at a time."""

    def __init__(self, server: ViserServer) -> None:
        self._scene = server.scene
        self._handles: dict[str, Any] = {}
        self._sizes: dict[str, tuple[float, float]] = {}
        self._hidden: set[str] = set()

    def image(self, name: str, image: MapImage) -> None:
        """Pixels on the floor."""
        x, y, yaw = image.map_from_middle
        position = (float(x), float(y), ORDER.index(name) * STEP)
        wxyz = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
        handle = self._handles.get(name)
        if handle is not None and self._sizes[name] == image.size:
            handle.image = image.pixels
            handle.position, handle.wxyz = position, wxyz
            return
        self._sizes[name] = image.size
        self._handles[name] = self._scene.add_image(
            f"/{name}",
            image.pixels,
            *image.size,
            format="png",
            position=position,
            wxyz=wxyz,
            visible=self.is_shown(name),
        )

    def segments(
        self,
        name: str,
        ends: NDArray[np.float64],
        color: Color | NDArray[np.uint8],
        width: float = 2.0,
    ) -> None:
        """Lines between ends (N, 2, 2), ``width`` pixels thick, in one colour or each in its own (N, 3)."""
        if len(ends) == 0:
            self.clear(name)
            return
        heights = np.full((*ends.shape[:2], 1), ORDER.index(name) * STEP)
        points = np.concatenate([ends, heights], axis=2).astype(np.float32)
        colors = np.asarray(color, dtype=np.uint8)
        if colors.ndim == 2:
            colors = np.repeat(colors[:, None], 2, axis=1)
        handle = self._handles.get(name)
        if handle is not None and np.array_equal(handle.colors, colors) and handle.thickness == width:
            if not np.array_equal(handle.points, points):
                handle.points = points
            return
        self._handles[name] = self._scene.add_line_segments(
            f"/{name}",
            points,
            colors,
            thickness=width,
            thickness_units="screen",
            visible=self.is_shown(name),
        )

    def line(
        self, name: str, points: NDArray[np.float64], color: Color | NDArray[np.uint8], width: float = 2.0
    ) -> None:
        """A line through points (N, 2); of one point there is none. Segments may have colours (N - 1, 3)."""
        self.segments(name, np.stack([points[:-1], points[1:]], axis=1), color, width)

    def dots(
        self, name: str, points: NDArray[np.float64], color: Color | NDArray[np.uint8], width: float = 4.0
    ) -> None:
        """Dots at points (N, 2), ``width`` pixels wide."""
        self.segments(name, np.stack([points, points + np.array([_DOT, 0.0])], axis=1), color, width)

    def arrows(self, name: str, poses: Pose, color: Color, length: float, width: float = 2.0) -> None:
        """Short lines from poses (N, 3) to where they look."""
        ahead = length * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        self.segments(name, np.stack([poses[:, :2], poses[:, :2] + ahead], axis=1), color, width)

    def clear(self, *names: str) -> None:
        """Take layers away."""
        for name in names:
            handle = self._handles.pop(name, None)
            if handle is not None:
                handle.remove()

    def clear_all(self) -> None:
        """Take all layers away."""
        self.clear(*list(self._handles))

    def begin_anew(self) -> None:
        """Take all layers away, and hide none of those to come."""
        self.clear_all()
        self._hidden.clear()

    def is_shown(self, name: str) -> bool:
        """Whether a layer is to be seen."""
        return name not in self._hidden

    def show(self, name: str, *, is_wanted: bool) -> None:
        """Whether a layer is to be seen, now and when it is drawn anew."""
        self._hidden.discard(name)
        if not is_wanted:
            self._hidden.add(name)
        if name in self._handles:
            self._handles[name].visible = is_wanted
