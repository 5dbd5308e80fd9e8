"""What the mapper node displays: the growing map, its pose graph and the path."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from visualization_msgs.msg import MarkerArray

from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.live.display.node_display import DrivenPath, NodeDisplay
from racecar.pipelines.live.monitoring.health import Health
from racecar.pipelines.live.ros.graph_markers import graph_markers
from racecar.pipelines.live.ros.qos import LATCHED
from racecar.pipelines.live.work.worker import Worker
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_MAP_EVERY, _GRAPH_EVERY, _VIEW_EVERY = 0.5, 2.0, 0.5
"""Seconds. Chosen by judgement: longer for what takes more work."""


class MapperDisplay(NodeDisplay):
    """Also publishes the pose graph and the growing map."""

    def __init__(
        self,
        node: Any,
        map_frame: str,
        new_grid: Callable[[], GrowingGrid],
        worker: Worker,
        drawer: Worker,
        keep: Callable[[Session, OccupancyGrid], None],
        view: "WatchScreen | None",
        health: Health,
    ) -> None:
        """``drawer`` draws the map into a ``new_grid``, so that it need not wait for the other work, and
        passes it on to ``keep``."""
        super().__init__(node, map_frame, worker, view, publishes_map=True, tells_places=False)
        self._drawer, self._keep, self._health = drawer, keep, health
        self._new_grid, self._grid = new_grid, new_grid()
        self._graph_topic = node.create_publisher(MarkerArray, "pose_graph", LATCHED)

    @property
    def times_redrawn(self) -> int:
        """Number of times the whole map was redrawn."""
        return self._grid.redrawn

    def begin_anew(self) -> None:
        """Start displaying another map and path."""
        self._grid, self._path = self._new_grid(), DrivenPath()

    def show(self, stamp: Any, scan: Scan, map_from_base: Pose, mapper: Mapper) -> None:
        """Display a scan at its pose, and append the pose to the path."""
        self._show_path(stamp, map_from_base)
        if self._schedule.is_due("map", _MAP_EVERY):
            draw = partial(self._grid.draw, *mapper.seen_so_far())
            self._drawer.put("map", partial(self._publish_map, stamp, draw, mapper.session()))
        if self._is_wanted(self._graph_topic, _GRAPH_EVERY):
            self._publish(self._graph_topic, partial(graph_markers, stamp, self._map_frame, mapper.session()))
        self._show_in_browser(_VIEW_EVERY, scan, map_from_base)

    def _publish_map(self, stamp: Any, draw: Callable[[], OccupancyGrid], session: Session) -> None:
        grid = draw()
        self.show_map(grid, stamp)
        self._health.note("maps")
        self._keep(session, grid)
