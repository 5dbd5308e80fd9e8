"""What the localizer's node shows to people: the map, the scan laid over it, particles and the path."""

from functools import partial
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseArray
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path as PathMessage
from sensor_msgs.msg import PointCloud2

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.live.display.clicks import ClickedGoals, ClickedPlaces
from racecar.pipelines.live.display.driven_path import DrivenPath
from racecar.pipelines.live.ros.bulk_messages import path_bytes, pose_array_bytes
from racecar.pipelines.live.ros.messages import cloud_message, grid_message
from racecar.pipelines.live.ros.parameters import declare_positive
from racecar.pipelines.live.ros.qos import LATCHED, is_heard
from racecar.pipelines.live.work.schedule import Schedule
from racecar.pipelines.live.work.worker import Worker
from racecar.pipelines.studio.watch.tools import Senders

if TYPE_CHECKING:
    from racecar.pipelines.live.display.browser_view import LiveView

DISPLAY_WORK = {"cloud": 1, "particles": 1, "path": 1, "view": 1}
"""Kinds of work for the worker, and how much of each may wait: the newest is enough to look at."""

_PATH_PERIOD = 1.0
_VIEW_PERIOD = 0.2
"""Seconds; the browser shows a car that moves, RViz draws it from the transform: by judgement."""


class LocalizerDisplay:
    """Publishes what is due and looked at, and fills the page in the browser; another thread does it."""

    def __init__(
        self, node: Any, map_frame: str, worker: Worker, view: "LiveView | None", *, publishes_map: bool
    ) -> None:
        """``publishes_map``: unless it is somebody else who does. Raises UserError that names a parameter at
        fault."""
        self._node, self._map_frame, self._worker, self._view = node, map_frame, worker, view
        self._path = DrivenPath()
        particle_rate = declare_positive(
            node, "particle_rate", 5.0, "times per second that particles are published, when anyone listens"
        )
        cloud_rate = declare_positive(
            node, "cloud_rate", 10.0, "times per second that the laid-over scan is published, likewise"
        )
        self._schedule = Schedule(
            {
                "particles": 1.0 / particle_rate,
                "cloud": 1.0 / cloud_rate,
                "path": _PATH_PERIOD,
                "view": _VIEW_PERIOD,
            }
        )
        create = node.create_publisher
        self._particle_topic = create(PoseArray, "particle_cloud", 1)
        self._cloud_topic = create(PointCloud2, "scan_on_map", 1)
        self._path_topic = create(PathMessage, "path", LATCHED)
        self._map_topic = create(OccupancyGridMessage, "map", LATCHED) if publishes_map else None
        self._clicks: list[ClickedGoals | ClickedPlaces] = []
        if view is not None:
            goals, places = ClickedGoals(node, map_frame), ClickedPlaces(node, map_frame)
            view.connect(Senders(goals.send, places.send))
            self._clicks = [goals, places]

    def tell(self, words: str) -> None:
        """How the node is, in Markdown, for the page."""
        if self._view is not None:
            self._view.tell(words)

    def end(self) -> None:
        """Send nothing any more that is clicked on the page."""
        for clicks in self._clicks:
            clicks.close()
        self.tell("The node has ended.")

    def show_map(self, grid: OccupancyGrid) -> None:
        """The map from now on."""
        if self._view is not None:
            self._view.show_map(grid)
        if self._map_topic is not None:
            now = self._node.get_clock().now().to_msg()
            self._map_topic.publish(grid_message(now, self._map_frame, grid))

    def show(self, stamp: Any, scan: Scan, estimate: PoseEstimate, localizer: Localizer) -> None:
        """A scan with its estimate, whose pose is the next of the path."""
        map_from_base, put = estimate.map_from_base, self._worker.inbox.put
        self._path.add(map_from_base)
        if self._schedule.is_due("cloud") and is_heard(self._cloud_topic):
            put("cloud", partial(self._publish_cloud, stamp, scan, map_from_base))
        if self._schedule.is_due("particles") and is_heard(self._particle_topic):
            put("particles", partial(self._publish_particles, stamp, localizer))
        if self._schedule.is_due("path") and is_heard(self._path_topic):
            put("path", partial(self._publish_path, stamp))
        if self._view is not None and self._schedule.is_due("view"):
            put("view", partial(self._show_in_browser, self._view, scan, map_from_base, localizer))

    def _publish_cloud(self, stamp: Any, scan: Scan, map_from_base: Pose) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        self._cloud_topic.publish(cloud_message(stamp, self._map_frame, points))

    def _publish_particles(self, stamp: Any, localizer: Localizer) -> None:
        self._particle_topic.publish(pose_array_bytes(stamp, self._map_frame, localizer.particles()[0]))

    def _publish_path(self, stamp: Any) -> None:
        self._path_topic.publish(path_bytes(stamp, self._map_frame, self._path.poses))

    def _show_in_browser(
        self, view: "LiveView", scan: Scan, map_from_base: Pose, localizer: Localizer
    ) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        view.show(map_from_base, points, self._path.poses, localizer.particles()[0])
