"""What the mapper's node shows to people: the map as it grows, its pose graph and the path."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path as PathMessage
from visualization_msgs.msg import MarkerArray

from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.mapping.state.growth import Growth
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.live.display.clicks import ClickedGoals
from racecar.pipelines.live.display.driven_path import DrivenPath
from racecar.pipelines.live.monitoring.health import Health
from racecar.pipelines.live.ros.bulk_messages import path_bytes
from racecar.pipelines.live.ros.graph_markers import graph_markers
from racecar.pipelines.live.ros.messages import grid_message
from racecar.pipelines.live.ros.qos import LATCHED, is_heard
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.studio.watch.tools import Senders

if TYPE_CHECKING:
    from racecar.pipelines.live.display.browser_view import LiveView

DISPLAY_WORK, DRAWING_WORK = {"graph": 1, "path": 1, "view": 1}, {"map": 1}
"""Kinds of work for the worker and for the drawer, and how much of each may wait: the newest is enough to
look at."""

_PERIODS = {"map": 0.5, "graph": 2.0, "path": 1.0, "view": 0.5}
"""Seconds; the more work it is to make, the longer: by judgement."""


class MapperDisplay:
    """Publishes what is due, and fills the page in the browser; other threads do the work."""

    def __init__(
        self,
        node: Any,
        map_frame: str,
        new_grid: Callable[[], GrowingGrid],
        worker: Worker,
        drawer: Worker,
        view: "LiveView | None",
        health: Health,
    ) -> None:
        """``drawer`` draws the map into a ``new_grid``; beside other work it would wait while a checkpoint is
        written."""
        self._map_frame, self._worker, self._drawer = map_frame, worker, drawer
        self._view, self._health = view, health
        self._new_grid, self._grid = new_grid, new_grid()
        self._path = DrivenPath()
        self._schedule = Schedule(_PERIODS)
        create = node.create_publisher
        self._map_topic = create(OccupancyGridMessage, "map", LATCHED)
        self._graph_topic = create(MarkerArray, "pose_graph", LATCHED)
        self._path_topic = create(PathMessage, "path", LATCHED)
        self.growth: Growth | None = None
        """How much is mapped, as the page was shown it last."""
        self._clicks: ClickedGoals | None = None
        if view is not None:
            self._clicks = ClickedGoals(node, map_frame)
            view.connect(Senders(self._clicks.send))

    @property
    def times_redrawn(self) -> int:
        """How often the whole map was redrawn."""
        return self._grid.redrawn

    def begin_anew(self) -> None:
        """Another map is shown from now on, and another path."""
        self._grid, self._path = self._new_grid(), DrivenPath()

    def tell(self, words: str) -> None:
        """How the node is, in Markdown, for the page."""
        if self._view is not None:
            self._view.tell(words)

    def end(self) -> None:
        """Send nothing any more that is clicked on the page."""
        if self._clicks is not None:
            self._clicks.close()
        self.tell("The drive is over; its map is being finished and saved.")

    def show(self, stamp: Any, scan: Scan, map_from_base: Pose, mapper: Mapper) -> None:
        """A scan and where it was taken, which is the next pose of the path."""
        self._path.add(map_from_base)
        if self._schedule.is_due("map"):
            draw = partial(self._grid.draw, *mapper.seen_so_far())
            self._drawer.inbox.put("map", partial(self._publish_map, stamp, draw))
        put = self._worker.inbox.put
        if self._schedule.is_due("graph") and is_heard(self._graph_topic):
            put("graph", partial(self._publish_graph, stamp, mapper.session()))
        if self._schedule.is_due("path") and is_heard(self._path_topic):
            put("path", partial(self._publish_path, stamp))
        if self._view is not None and self._schedule.is_due("view"):
            self.growth = mapper.growth
            put("view", partial(self._show_in_browser, self._view, scan, map_from_base))

    def _publish_map(self, stamp: Any, draw: Callable[[], OccupancyGrid]) -> None:
        grid = draw()
        self._map_topic.publish(grid_message(stamp, self._map_frame, grid))
        self._health.note("maps")
        if self._view is not None:
            self._view.show_map(grid)

    def _publish_graph(self, stamp: Any, session: Session) -> None:
        self._graph_topic.publish(graph_markers(stamp, self._map_frame, session))

    def _publish_path(self, stamp: Any) -> None:
        self._path_topic.publish(path_bytes(stamp, self._map_frame, self._path.poses))

    def _show_in_browser(self, view: "LiveView", scan: Scan, map_from_base: Pose) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        view.show(map_from_base, points, self._path.poses)
