"""Where frames of maps lie, as localizers and mappers publish it."""

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.converters.transforms import ends_of, matrix_of, seen_from_above
from racecar.pipelines.bags.messages import TRANSFORMS, ros2_types
from racecar.pipelines.live.ros.message_types import transform_message_type

_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE)


class MapLinks:
    """Hears on ``/tf`` where the frame of the car's odometry lies in others."""

    def __init__(self, node: Any, odom_frame: str) -> None:
        self._odom_frame = odom_frame
        self._frame_from_odom: dict[str, Pose] = {}
        node.create_subscription(transform_message_type(), "/tf", self._take, _QOS, raw=True)

    def frame_from_odom(self, frame: str) -> Pose | None:
        """(3,), the latest; None where nobody has published it."""
        return self._frame_from_odom.get(frame)

    def _take(self, serialized: bytes) -> None:
        message: Any = ros2_types().deserialize_cdr(serialized, TRANSFORMS)
        for transform in message.transforms:
            parent, child = ends_of(transform)
            matrix = matrix_of(transform) if child == self._odom_frame else None
            if matrix is not None:
                self._frame_from_odom[parent] = seen_from_above(matrix)
