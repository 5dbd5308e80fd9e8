"""Odometry from transforms, for a car that publishes no Odometry messages."""

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.pipelines.bags.converters.transforms import (
    OdometryLinks,
    ends_of,
    inverted,
    matrix_of,
    seen_from_above,
)
from racecar.pipelines.bags.messages import nanoseconds
from racecar.sensors.odometry import Odometry

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import tf2_msgs__msg__TFMessage


class TransformOdometryConverter:
    """Converts messages that contain the odometry links, among others, to samples."""

    def __init__(self, links: OdometryLinks, counts: Counter[str]) -> None:
        self._driving = links.driving.ends
        self._frames = links.frames
        self._poses = list(links.poses)
        self._counts = counts
        self._last: Odometry | None = None

    def stamp_of(self, message: "tf2_msgs__msg__TFMessage") -> int | None:
        """Stamp in nanoseconds of the link that moves most; None if a message lacks it or repeats the last
        one, as some publishers do."""
        for transform in message.transforms:
            if ends_of(transform) == self._driving:
                return nanoseconds(transform.header.stamp)
        self._take(message)
        return None

    def convert(self, message: "tf2_msgs__msg__TFMessage", stamp: int) -> Odometry | None:
        """The sample; None if the message has no valid pose or the same stamp as the last."""
        is_valid = self._take(message)
        if self._last is not None and stamp == self._last.stamp:
            return None
        if not is_valid:
            self._counts["invalid_odometry"] += 1
            return None
        odom_from_base = np.eye(4)
        for pose in self._poses:
            odom_from_base = odom_from_base @ pose
        pose = seen_from_above(odom_from_base)
        self._last = Odometry(stamp, pose, self._twist(pose, stamp))
        return self._last

    def _take(self, message: "tf2_msgs__msg__TFMessage") -> bool:
        """Add each link; returns whether all of them are valid."""
        is_valid = True
        for transform in message.transforms:
            ends = ends_of(transform)
            for index in range(len(self._poses)):
                if ends in ((above_below := self._frames[index : index + 2]), above_below[::-1]):
                    pose = matrix_of(transform)
                    is_valid &= pose is not None
                    if pose is not None:
                        self._poses[index] = pose if ends == above_below else inverted(pose)
        return is_valid

    def _twist(self, odom_from_base: Pose, stamp: int) -> Pose:
        """Mean twist since the last sample, since transforms have none."""
        seconds = 0.0 if self._last is None else (stamp - self._last.stamp) * 1e-9
        if self._last is None or seconds <= 0:
            return IDENTITY
        return between(self._last.odom_from_base, odom_from_base) / seconds
