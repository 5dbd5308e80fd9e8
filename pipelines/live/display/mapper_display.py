"""What the mapper's node shows to people: the map as it grows, its pose graph and the path."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from visualization_msgs.msg import MarkerArray

from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.mapping.state.growth import Growth
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.live.display.node_display import DrivenPath, NodeDisplay
from racecar.pipelines.live.monitoring.health import Health
from racecar.pipelines.live.ros.graph_markers import graph_markers
from racecar.pipelines.live.ros.qos import LATCHED, is_heard
from racecar.pipelines.live.work.worker import Worker
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

DISPLAY_WORK, DRAWING_WORK = {"graph": 1, "path": 1, "view": 1}, {"map": 1}
"""Kinds of work for the worker and for the drawer, and how much of each may wait: the newest is enough to
look at."""

_PERIODS = {"map": 0.5, "graph": 2.0, "path": 1.0, "view": 0.5}
"""Seconds; the more work it is to make, the longer: by judgement."""


class MapperDisplay(NodeDisplay):
    """Also the pose graph, and the map as it grows."""

    last_words = "The drive is over; its map is being finished and saved."

    def __init__(
        self,
        node: Any,
        map_frame: str,
        new_grid: Callable[[], GrowingGrid],
        worker: Worker,
        drawer: Worker,
        view: "WatchScreen | None",
        health: Health,
    ) -> None:
        """``drawer`` draws the map into a ``new_grid``; beside other work it would wait for that."""
        super().__init__(node, map_frame, worker, view, _PERIODS, publishes_map=True, tells_places=False)
        self._drawer, self._health = drawer, health
        self._new_grid, self._grid = new_grid, new_grid()
        self._graph_topic = node.create_publisher(MarkerArray, "pose_graph", LATCHED)
        self.growth: Growth | None = None
        """How much is mapped, as the page was shown it last."""

    @property
    def times_redrawn(self) -> int:
        """How often the whole map was redrawn."""
        return self._grid.redrawn

    def begin_anew(self) -> None:
        """Another map is shown from now on, and another path."""
        self._grid, self._path = self._new_grid(), DrivenPath()

    def show(self, stamp: Any, scan: Scan, map_from_base: Pose, mapper: Mapper) -> None:
        """A scan and where it was taken, which is the next pose of the path."""
        self._show_path(stamp, map_from_base)
        if self._schedule.is_due("map"):
            draw = partial(self._grid.draw, *mapper.seen_so_far())
            self._drawer.inbox.put("map", partial(self._publish_map, stamp, draw))
        put = self._worker.inbox.put
        if self._schedule.is_due("graph") and is_heard(self._graph_topic):
            put("graph", partial(self._publish_graph, stamp, mapper.session()))
        if self._view is not None and self._schedule.is_due("view"):
            self.growth = mapper.growth
            put("view", partial(self._show_in_browser, self._view, scan, map_from_base))

    def _publish_map(self, stamp: Any, draw: Callable[[], OccupancyGrid]) -> None:
        self.show_map(draw(), stamp)
        self._health.note("maps")

    def _publish_graph(self, stamp: Any, session: Session) -> None:
        self._graph_topic.publish(graph_markers(stamp, self._map_frame, session))

    def _show_in_browser(self, view: "WatchScreen", scan: Scan, map_from_base: Pose) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        view.show(map_from_base, points, self._path.poses)
