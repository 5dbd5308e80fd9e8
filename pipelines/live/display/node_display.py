"""What both nodes display: the map, the path driven, and the page in the browser."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path as PathMessage

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.live.display.clicks import Clicks
from racecar.pipelines.live.ros.bulk_messages import path_bytes
from racecar.pipelines.live.ros.messages import grid_message
from racecar.pipelines.live.ros.qos import LATCHED, is_heard
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.runs.view.headline import Headline
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_PATH_EVERY = 1.0
"""Seconds. Chosen by judgement."""
_SPACING = 0.05
"""Metres between poses of a path. Chosen by judgement: below the width of the drawn line."""
_MOST = 4000
"""Poses. Chosen by judgement, since a message of them is published every second."""


class NodeDisplay:
    """Publishes what is due and has subscribers, and updates the page; other threads do the work."""

    def __init__(
        self,
        node: Any,
        map_frame: str,
        worker: Worker,
        view: "WatchScreen | None",
        *,
        publishes_map: bool,
        tells_places: bool,
    ) -> None:
        """``publishes_map``: False if another node publishes the map; ``tells_places``: whether clicks may
        set the car's place."""
        self._node, self._map_frame, self._worker, self._view = node, map_frame, worker, view
        self._path, self._schedule = DrivenPath(), Schedule()
        self._path_topic = node.create_publisher(PathMessage, "path", LATCHED)
        self._map_topic = (
            node.create_publisher(OccupancyGridMessage, "map", LATCHED) if publishes_map else None
        )
        if view is not None:
            self._clicks = Clicks(node, map_frame, tells_places=tells_places)
            view.connect(self._clicks.send_goal, self._clicks.send_place if tells_places else None)

    def tell(self, headline: Headline, words: str) -> None:
        """Show the node's state on the page: a headline, and words in Markdown."""
        if self._view is not None:
            self._view.tell(headline, words)

    def end(self, last_words: str) -> None:
        """Stop publishing clicks on the page."""
        if self._view is not None:
            self._clicks.close()
        self.tell(Headline(last_words), "")

    def show_map(self, grid: OccupancyGrid, stamp: Any = None) -> None:
        """Display a map; its stamp is the current time by default."""
        if self._view is not None:
            self._view.show_map(grid)
        if self._map_topic is not None:
            stamp = self._node.get_clock().now().to_msg() if stamp is None else stamp
            self._map_topic.publish(grid_message(stamp, self._map_frame, grid))

    def _show_path(self, stamp: Any, map_from_base: Pose) -> None:
        """Append a pose (3,) to the path."""
        self._path.add(map_from_base)
        if self._is_wanted(self._path_topic, _PATH_EVERY):
            self._publish(self._path_topic, lambda: path_bytes(stamp, self._map_frame, self._path.poses))

    def _is_wanted(self, topic: Any, period: float) -> bool:
        """Whether a message is due, one per ``period`` in seconds, and has subscribers."""
        return self._schedule.is_due(topic.topic_name, period) and is_heard(topic)

    def _publish(self, topic: Any, message: Callable[[], Any]) -> None:
        """Have the worker make and publish a message."""
        self._worker.put(topic.topic_name, lambda: topic.publish(message()))

    def _show_in_browser(
        self, period: float, scan: Scan, map_from_base: Pose, particles: Callable[[], Pose] | None = None
    ) -> None:
        view = self._view
        if view is None or not self._schedule.is_due("view", period):
            return

        def show() -> None:
            points = transform_points(map_from_base, scan.points_in_base())
            view.show(map_from_base, points, self._path.poses, None if particles is None else particles())

        self._worker.put("view", show)


class DrivenPath:
    """Poses at a minimum spacing; when there are too many, every other one is dropped."""

    def __init__(self) -> None:
        self._poses = np.zeros((_MOST, 3))
        self._count = 0
        self._spacing = _SPACING

    def add(self, pose: Pose) -> None:
        """Append a pose (3,)."""
        if self._count and np.hypot(*(pose - self._poses[self._count - 1])[:2]) < self._spacing:
            return
        if self._count == _MOST:
            kept = self._poses[::2].copy()
            self._count, self._spacing = len(kept), 2 * self._spacing
            self._poses[: self._count] = kept
        self._poses[self._count] = pose
        self._count += 1

    @property
    def poses(self) -> Pose:
        """(N, 3), a copy."""
        return self._poses[: self._count].copy()
