"""What the localizer's node shows to people: the map, the scan laid over it, particles and the path."""

from functools import partial
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseArray
from pydantic import Field
from sensor_msgs.msg import PointCloud2

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.settings import Settings
from racecar.pipelines.live.display.node_display import NodeDisplay
from racecar.pipelines.live.ros.bulk_messages import pose_array_bytes
from racecar.pipelines.live.ros.messages import cloud_message
from racecar.pipelines.live.ros.parameters import declare_settings
from racecar.pipelines.live.ros.qos import is_heard
from racecar.pipelines.live.work.worker import Worker
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

DISPLAY_WORK = {"cloud": 1, "particles": 1, "path": 1, "view": 1}
"""Kinds of work for the worker, and how much of each may wait: the newest is enough to look at."""

_PERIODS = {"path": 1.0, "view": 0.2}
"""Seconds; the browser shows a car that moves, RViz draws it from the transform: by judgement."""


class _Rates(Settings):
    """Per second, when anyone listens."""

    particle_rate: float = Field(
        5.0,
        gt=0.0,
        le=1000.0,
        description="times per second that particles are published, when anyone listens",
    )
    cloud_rate: float = Field(
        10.0,
        gt=0.0,
        le=1000.0,
        description="times per second that the laid-over scan is published, likewise",
    )


class LocalizerDisplay(NodeDisplay):
    """Also the scan laid over the map, and the particles."""

    last_words = "The node has ended."

    def __init__(
        self, node: Any, map_frame: str, worker: Worker, view: "WatchScreen | None", *, publishes_map: bool
    ) -> None:
        """Raises UserError that names a parameter at fault."""
        rates = declare_settings(node, _Rates(), read_only=True)
        periods = {"particles": 1.0 / rates.particle_rate, "cloud": 1.0 / rates.cloud_rate, **_PERIODS}
        super().__init__(
            node, map_frame, worker, view, periods, publishes_map=publishes_map, tells_places=True
        )
        self._particle_topic = node.create_publisher(PoseArray, "particle_cloud", 1)
        self._cloud_topic = node.create_publisher(PointCloud2, "scan_on_map", 1)

    def show(self, stamp: Any, scan: Scan, estimate: PoseEstimate, localizer: Localizer) -> None:
        """A scan with its estimate, whose pose is the next of the path."""
        map_from_base, put = estimate.map_from_base, self._worker.inbox.put
        self._show_path(stamp, map_from_base)
        if self._schedule.is_due("cloud") and is_heard(self._cloud_topic):
            put("cloud", partial(self._publish_cloud, stamp, scan, map_from_base))
        if self._schedule.is_due("particles") and is_heard(self._particle_topic):
            put("particles", partial(self._publish_particles, stamp, localizer))
        if self._view is not None and self._schedule.is_due("view"):
            put("view", partial(self._show_in_browser, self._view, scan, map_from_base, localizer))

    def _publish_cloud(self, stamp: Any, scan: Scan, map_from_base: Pose) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        self._cloud_topic.publish(cloud_message(stamp, self._map_frame, points))

    def _publish_particles(self, stamp: Any, localizer: Localizer) -> None:
        self._particle_topic.publish(pose_array_bytes(stamp, self._map_frame, localizer.particles()[0]))

    def _show_in_browser(
        self, view: "WatchScreen", scan: Scan, map_from_base: Pose, localizer: Localizer
    ) -> None:
        points = transform_points(map_from_base, scan.points_in_base())
        view.show(map_from_base, points, self._path.poses, localizer.particles()[0])
