"""What the localizer node displays: the map, the scan on the map, the particles and the path."""

from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseArray
from pydantic import Field
from sensor_msgs.msg import PointCloud2

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.settings import Settings
from racecar.pipelines.bags.messages import PARTICLE_CLOUD
from racecar.pipelines.live.display.node_display import NodeDisplay
from racecar.pipelines.live.ros.bulk_messages import particle_cloud_bytes, pose_array_bytes
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.messages import cloud_message
from racecar.pipelines.live.ros.parameters import declare_settings
from racecar.pipelines.live.work.worker import Worker
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

_VIEW_EVERY = 0.2
"""Seconds. Chosen by judgement: the browser shows a moving car, while RViz draws it from the transform."""


class _Rates(Settings):
    """Rates in messages per second, if there are subscribers."""

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
    """Also publishes the scan on the map, and the particles."""

    def __init__(
        self, node: Any, map_frame: str, worker: Worker, view: "WatchScreen | None", *, publishes_map: bool
    ) -> None:
        """Raises UserError that names the invalid parameter."""
        self._rates = declare_settings(node, _Rates(), read_only=True)
        super().__init__(node, map_frame, worker, view, publishes_map=publishes_map, tells_places=True)
        kind = message_class(PARTICLE_CLOUD)
        self._particle_topic = None if kind is None else node.create_publisher(kind, "particle_cloud", 1)
        self._arrow_topic = node.create_publisher(PoseArray, "pf/viz/particles", 1)
        """The same without weights, since RViz shows a ParticleCloud only with nav2, and Foxglove none."""
        self._cloud_topic = node.create_publisher(PointCloud2, "scan_on_map", 1)

    def show(self, stamp: Any, scan: Scan, estimate: PoseEstimate, localizer: Localizer) -> None:
        """Display a scan and its estimate, and append the pose to the path."""
        map_from_base, frame = estimate.map_from_base, self._map_frame

        def particles() -> Pose:
            return localizer.particles()[0]

        def cloud() -> Any:
            return cloud_message(stamp, frame, transform_points(map_from_base, scan.points_in_base()))

        self._show_path(stamp, map_from_base)
        if self._is_wanted(self._cloud_topic, 1.0 / self._rates.cloud_rate):
            self._publish(self._cloud_topic, cloud)
        particle_period = 1.0 / self._rates.particle_rate
        if self._particle_topic is not None and self._is_wanted(self._particle_topic, particle_period):
            self._publish(
                self._particle_topic, lambda: particle_cloud_bytes(stamp, frame, *localizer.particles())
            )
        if self._is_wanted(self._arrow_topic, particle_period):
            self._publish(self._arrow_topic, lambda: pose_array_bytes(stamp, frame, particles()))
        self._show_in_browser(_VIEW_EVERY, scan, map_from_base, particles)
