"""Publish the transform of the car on the map."""

from typing import Any

from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.pipelines.bags.messages import nanoseconds
from racecar.pipelines.live.ros.message_types import transform_message_type
from racecar.pipelines.live.ros.messages import transform_bytes
from racecar.pipelines.live.ros.parameters import CarParameters


class TransformBroadcaster:
    """Publishes on ``/tf`` as configured by the parameters."""

    def __init__(self, node: Any, parameters: CarParameters) -> None:
        """Raises UserError if the parameters request transforms that cannot be published."""
        self._parameters = parameters
        self._tolerance = round(parameters.transform_tolerance * 1e9)
        self._publisher = (
            None if parameters.tf == "none" else node.create_publisher(transform_message_type(), "/tf", 100)
        )

    def publish(self, stamp: Any, map_from_base: Pose, odom_frame: str, odom_from_base: Pose | None) -> None:
        """Publish the car's pose at a stamp, on the map (3,) and by odometry (3,), None without odometry."""
        if self._publisher is None:
            return
        until = nanoseconds(stamp) + self._tolerance
        parent = self._parameters.map_frame
        if self._parameters.tf == "base":
            child = self._parameters.tf_base_frame
            self._publisher.publish(transform_bytes(until, parent, child, map_from_base))
        elif odom_from_base is not None:
            map_from_odom = compose(map_from_base, inverse(odom_from_base))
            self._publisher.publish(transform_bytes(until, parent, odom_frame, map_from_odom))
