"""What both nodes show to people: the map, the path driven, and the page in the browser."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path as PathMessage

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.live.display.clicks import ClickedGoals, ClickedPlaces
from racecar.pipelines.live.ros.bulk_messages import path_bytes
from racecar.pipelines.live.ros.messages import grid_message
from racecar.pipelines.live.ros.qos import LATCHED, is_heard
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_SPACING = 0.05
"""Metres between poses of a path: finer than a line is drawn, by judgement."""
_MOST = 4000
"""Poses, as a message of them is published every second: by judgement."""


class NodeDisplay:
    """Publishes what is due and looked at, and fills the page in the browser; other threads do the work."""

    last_words: ClassVar[str]
    """For the page, when the node ends."""

    def __init__(
        self,
        node: Any,
        map_frame: str,
        worker: Worker,
        view: "WatchScreen | None",
        periods: Mapping[str, float],
        *,
        publishes_map: bool,
        tells_places: bool,
    ) -> None:
        """``periods``: seconds by kind of work, ``path`` among them; ``publishes_map``: unless it is somebody
        else who does; ``tells_places``: whether clicks may say where the car is."""
        self._node, self._map_frame, self._worker, self._view = node, map_frame, worker, view
        self._path, self._schedule = DrivenPath(), Schedule(periods)
        self._path_topic = node.create_publisher(PathMessage, "path", LATCHED)
        self._map_topic = (
            node.create_publisher(OccupancyGridMessage, "map", LATCHED) if publishes_map else None
        )
        self._clicks: list[ClickedGoals | ClickedPlaces] = []
        if view is not None:
            goals = ClickedGoals(node, map_frame)
            places = ClickedPlaces(node, map_frame) if tells_places else None
            view.connect(goals.send, None if places is None else places.send)
            self._clicks = [goals, *([] if places is None else [places])]

    def tell(self, words: str) -> None:
        """How the node is, in Markdown, for the page."""
        if self._view is not None:
            self._view.tell(words)

    def end(self) -> None:
        """Send nothing any more that is clicked on the page."""
        for clicks in self._clicks:
            clicks.close()
        self.tell(self.last_words)

    def show_map(self, grid: OccupancyGrid, stamp: Any = None) -> None:
        """The map from now on, of now unless it has a stamp."""
        if self._view is not None:
            self._view.show_map(grid)
        if self._map_topic is not None:
            stamp = self._node.get_clock().now().to_msg() if stamp is None else stamp
            self._map_topic.publish(grid_message(stamp, self._map_frame, grid))

    def _show_path(self, stamp: Any, map_from_base: Pose) -> None:
        """The path goes on to a pose (3,)."""
        self._path.add(map_from_base)
        if self._schedule.is_due("path") and is_heard(self._path_topic):
            self._worker.inbox.put("path", lambda: self._publish_path(stamp))

    def _publish_path(self, stamp: Any) -> None:
        self._path_topic.publish(path_bytes(stamp, self._map_frame, self._path.poses))


class DrivenPath:
    """Poses a little apart; when they become too many, every other one is dropped."""

    def __init__(self) -> None:
        self._poses = np.zeros((_MOST, 3))
        self._count = 0
        self._spacing = _SPACING

    def add(self, pose: Pose) -> None:
        """Continue to a pose (3,)."""
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
