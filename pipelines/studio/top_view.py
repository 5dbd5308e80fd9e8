"""The camera of each page: straight down, north up, moved by dragging and zoomed by the wheel.

A narrow angle from high above shows a plan without perspective. The page's own controls would tilt it. A
pane over the floor therefore receives drags of the left button and moves the camera; any other tilt is
corrected.
"""

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from viser import CameraHandle, ClientHandle, SceneNodeDragEvent, ViserServer

from racecar.pipelines.studio.scale_bar import ScaleBar

FIELD_OF_VIEW = math.radians(10.0)
"""Vertical field of view."""
_GLASS = np.array([[-3e5, -1e5, 0.03], [3e5, -1e5, 0.03], [0.0, 3e5, 0.03]])
"""Corners in metres: a triangle above all layers and wider than any map, of which only the edges are drawn.
A transparent surface would cost as much time as the map."""
_MARGIN = 1.08
"""Ratio of the visible size to that of the rectangle to show."""
_ROOM_TO_GROW = 0.3
"""Margin on each side as a share of a growing map's size, so that the view does not jump with every wall."""
_LEAST_HEIGHT = 5.0
"""Minimum height of the camera in metres; the view is then 0.9 m high."""
_FINGER = 0.02
"""Width of a finger as a share of the view's height: 14 pixels of a page of 720."""
_ASPECT, _HEIGHT = 1.4, 690
"""Width over height of the map, and its height in pixels, until a page has told its own: those of 1280 x 720
pixels without what surrounds the map."""
_SETTLED_AFTER, _NUDGE = 1.0, 1.0005
"""Seconds until a page's panel has its final size, and the invisible factor by which the camera then
rises."""
_OTHER_SIZE = 0.01
"""Relative difference of heights above which a map does not fit its page any more."""
_LOWEST = 1e-3
"""Minimum height of a camera in metres, below which there is no floor to look at."""
_OBEYED_AFTER = 1.0
"""Seconds during which a page may still report its old view after it was moved."""
_TILTED = 1e-3
"""Horizontal component of a unit direction above which a view counts as tilted."""


class _View(NamedTuple):
    """The requested view of a page."""

    middle: NDArray[np.float64]
    """(2,)"""
    height: float
    """Metres of the camera."""
    since: float
    """Seconds of the monotonic clock."""
    is_whole: bool = False
    """Whether all there is to see is to be seen, whatever the size of the page."""


Drag = Callable[[str, NDArray[np.float64], NDArray[np.float64]], bool]
"""Takes the phase ("start", "update", "end"), the start and the current place (2,); whether it is handled."""


class TopView:
    """The cameras of all pages."""

    def __init__(self, server: ViserServer, take_drag: Drag) -> None:
        """``take_drag`` is called first; a drag that it does not handle moves the map."""
        self._server, self._take_drag = server, take_drag
        self._bars: dict[int, ScaleBar] = {}
        self._grabbed: dict[int, NDArray[np.float64]] = {}
        self._views: dict[int, _View] = {}
        self._low, self._high = np.full(2, -10.0), np.full(2, 10.0)
        self.was_moved = False
        """Whether a user has moved the map by hand; whoever follows the car takes this back."""
        glass = server.scene.add_mesh_simple(
            "/glass", _GLASS, np.array([[0, 1, 2]]), wireframe=True, cast_shadow=False, receive_shadow=False
        )
        glass.on_drag("left")(self._drag)
        server.on_client_connect(self._meet)
        server.on_client_connect(self._learn_size)
        server.on_client_disconnect(self._part)

    def show_whole(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Show a rectangle between two corners (2,), on all current and future pages."""
        self._aim(low, high)
        for client in self._server.get_clients().values():
            self._look_at_whole(client.camera)

    def _aim(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Show a rectangle on future pages."""
        self._low, self._high = low, high
        camera = self._server.initial_camera
        camera.fov, camera.up = FIELD_OF_VIEW, (0.0, 1.0, 0.0)
        camera.near, camera.far = 1.0, 1e5
        camera.look_at = (*self._middle, 0.0)
        camera.position = (*self._middle, self._height(_ASPECT))

    @property
    def _middle(self) -> NDArray[np.float64]:
        middle: NDArray[np.float64] = (self._low + self._high) / 2.0
        return middle

    def _height(self, aspect: float) -> float:
        """Metres of a camera that sees the whole, on a page of this aspect."""
        width, depth = self._high - self._low
        tallest = max(float(depth), float(width) / aspect)
        return max(_LEAST_HEIGHT, _MARGIN * tallest / (2.0 * math.tan(FIELD_OF_VIEW / 2.0)))

    def _look_at_whole(self, camera: CameraHandle) -> None:
        self._look(camera, self._middle, self._height(_size(camera)[0]), is_whole=True)

    def keep_whole(self, extent: tuple[NDArray[np.float64], NDArray[np.float64]] | None) -> None:
        """When a map outgrows the view, show all of it with a margin, on the pages that no user has moved
        since."""
        if extent is None or (np.all(self._low <= extent[0]) and np.all(extent[1] <= self._high)):
            return
        more = _ROOM_TO_GROW * (extent[1] - extent[0])
        self._aim(extent[0] - more, extent[1] + more)
        for number, client in self._server.get_clients().items():
            if number in self._views and self._views[number].is_whole:
                self._look_at_whole(client.camera)

    def go_to(self, place: NDArray[np.float64], across: float) -> None:
        """Centre all pages on a place (2,), with at most ``across`` metres from bottom to top."""
        wanted = across / (2.0 * math.tan(FIELD_OF_VIEW / 2.0))
        for client in self._server.get_clients().values():
            height = min(float(client.camera.position[2]), wanted)
            self._look(client.camera, place, max(height, _LEAST_HEIGHT))

    def follow(self, place: NDArray[np.float64]) -> None:
        """Centre on a place (2,) without zooming in."""
        for client in self._server.get_clients().values():
            self._look(client.camera, place, float(client.camera.position[2]))

    @property
    def finger(self) -> float:
        """Width of a finger in metres on the floor, on the most zoomed-in page, the most precise one."""
        heights = [float(client.camera.position[2]) for client in self._server.get_clients().values()]
        lowest = min(heights, default=self._height(_ASPECT))
        return _FINGER * 2.0 * lowest * math.tan(FIELD_OF_VIEW / 2.0)

    @property
    def pixel(self) -> float:
        """Metres of a pixel of the most zoomed-in page."""
        pages = [
            (self._views[number].height, _size(client.camera)[1])
            for number, client in self._server.get_clients().items()
            if number in self._views
        ]
        height, pixels = min(pages, default=(self._height(_ASPECT), _HEIGHT))
        return 2.0 * height * math.tan(FIELD_OF_VIEW / 2.0) / pixels

    async def _meet(self, client: ClientHandle) -> None:
        client.camera.min_orbit_distance = _LEAST_HEIGHT
        bar = self._bars[client.client_id] = ScaleBar(client)
        self._look_at_whole(client.camera)  # a page first reports its own view, which is tilted
        client.camera.on_update(self._keep_upright)
        bar.fit(client.camera)

    async def _part(self, client: ClientHandle) -> None:
        self._bars.pop(client.client_id, None)
        self._grabbed.pop(client.client_id, None)
        self._views.pop(client.client_id, None)

    async def _keep_upright(self, camera: CameraHandle) -> None:
        """Store the view of a page, and correct it if it is tilted or under the floor: through its own
        controls, or briefly on the way to another view."""
        number = camera.client.client_id
        view = self._views.get(number)
        if view is None:
            return
        if _is_tilted(camera):
            _look(camera, view.middle, view.height)
        elif time.monotonic() > view.since + _OBEYED_AFTER:
            position = np.asarray(camera.position, dtype=np.float64)
            is_as_told = np.allclose(position, [*view.middle, view.height], rtol=1e-2, atol=1e-2)
            is_whole = view.is_whole and is_as_told
            self._views[number] = _View(position[:2].copy(), float(position[2]), view.since, is_whole)
        view = self._views[number]
        if view.is_whole and not math.isclose(
            view.height, self._height(_size(camera)[0]), rel_tol=_OTHER_SIZE
        ):
            self._look_at_whole(camera)
        bar = self._bars.get(number)
        if bar is not None:
            bar.fit(camera)

    async def _drag(self, event: SceneNodeDragEvent[Any]) -> None:
        """Move the map with the pointer, unless the drag has another meaning."""
        if event.phase == "start":
            self._grabbed[event.client_id] = np.array(event.start_position[:2])
        start = self._grabbed.get(event.client_id)
        if start is None:
            return
        if not self._take_drag(event.phase, start, np.array(event.end_position[:2])):
            camera = event.client.camera
            here = _point_under(camera, event.end_screen_pos)
            middle = np.asarray(camera.position, dtype=np.float64)[:2] + start - here
            self._look(camera, middle, float(camera.position[2]))
            self.was_moved = True

    def _learn_size(self, client: ClientHandle) -> None:
        """A page reports its size only with its view, and first before its panel appears: so the view is
        moved a little once the page has settled."""
        time.sleep(_SETTLED_AFTER)
        view = self._views.get(client.client_id)
        if view is not None:  # the page is still there
            self._look(client.camera, view.middle, _NUDGE * view.height, is_whole=view.is_whole)

    def _look(
        self, camera: CameraHandle, middle: NDArray[np.float64], height: float, *, is_whole: bool = False
    ) -> None:
        """Look straight down at a place (2,), north up."""
        self._views[camera.client.client_id] = _View(middle, height, time.monotonic(), is_whole)
        _look(camera, middle, height)


def floor_point(ray_origin: ArrayLike, ray_direction: ArrayLike) -> NDArray[np.float64]:
    """(2,) where a ray (3,), (3,) from above meets the floor."""
    origin, direction = np.asarray(ray_origin, dtype=np.float64), np.asarray(ray_direction, dtype=np.float64)
    point: NDArray[np.float64] = origin[:2] - origin[2] / direction[2] * direction[:2]
    return point


def _point_under(camera: CameraHandle, screen: tuple[float, float]) -> NDArray[np.float64]:
    """(2,) the floor under a position on the page, 0 to 1 to the right and down."""
    height = 2.0 * float(camera.position[2]) * math.tan(camera.fov / 2.0)
    aside = (screen[0] - 0.5) * height * camera.aspect
    point: NDArray[np.float64] = camera.position[:2] + np.array([aside, (0.5 - screen[1]) * height])
    return point


def _size(camera: CameraHandle) -> tuple[float, int]:
    """Aspect and height in pixels of a page's map; usual ones until the page has told them."""
    try:
        return camera.aspect, camera.image_height
    except (AssertionError, ZeroDivisionError):
        return _ASPECT, _HEIGHT


def _is_tilted(camera: CameraHandle) -> bool:
    """Whether a camera is not looking down at the floor with north up."""
    ahead = np.asarray(camera.look_at) - np.asarray(camera.position)
    sideways = math.hypot(ahead[0], ahead[1]) / max(float(np.linalg.norm(ahead)), 1e-9)
    is_upside_down = ahead[2] > 0.0 or camera.up_direction[1] < 1.0 - _TILTED
    return bool(sideways > _TILTED or is_upside_down or camera.position[2] < _LOWEST)


def _look(camera: CameraHandle, middle: NDArray[np.float64], height: float) -> None:
    with camera.client.atomic():
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = (*middle, height)
        camera.look_at = (*middle, 0.0)
