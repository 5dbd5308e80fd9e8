"""What a node sees, on a page in a browser of this machine, for those without RViz."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.watch.tools import NodeTool, Senders
from racecar.pipelines.studio.watch.watch_room import WatchRoom
from racecar.pipelines.studio.watched import Glimpse

_MOST_PARTICLES = 500
"""That are sent: more would only cover each other."""


class LiveView:
    """May be called by any thread: the page's own draws."""

    def __init__(self, page: Page, room: WatchRoom) -> None:
        self._page, self._room = page, room
        self.page = page.address
        """Where a browser finds it."""

    def connect(self, senders: Senders) -> None:
        """What is clicked goes there from now on."""
        self._page.request(lambda: self._room.connect(senders))

    def tell(self, words: str) -> None:
        """How the node is, in Markdown."""
        self._page.request(lambda: self._room.tell(words))

    def show_map(self, grid: OccupancyGrid) -> None:
        """The map from now on."""
        self._page.request(lambda: self._room.take_map(grid))

    def show(
        self,
        map_from_base: Pose,
        scan_in_map: NDArray[np.float64],
        path: Pose,
        particles: Pose | None = None,
    ) -> None:
        """The car (3,), its scan (N, 2), the path driven (M, 3), and particles (P, 3)."""
        if particles is not None:
            particles = particles[:: -(-len(particles) // _MOST_PARTICLES)]
        glimpse = Glimpse(map_from_base, scan_in_map, path.copy(), particles)
        self._page.request(lambda: self._room.take(glimpse))


@contextmanager
def live_view(title: str, port: int | None, tools: Sequence[NodeTool]) -> Iterator[LiveView]:
    """Serve a page to this machine, on the loopback address only, while the block lasts. Its clicks mean the
    first of the tools until another is chosen."""
    page = Page(title, port or 0)
    rooms: list[WatchRoom] = []

    def make() -> WatchRoom:
        rooms.append(WatchRoom(page, tools))
        return rooms[0]

    worker = threading.Thread(target=page.run, name="page", daemon=True)
    try:
        page.enter(make)
        worker.start()
        yield LiveView(page, rooms[0])
    finally:
        page.stop()
        worker.join()
        page.close()
