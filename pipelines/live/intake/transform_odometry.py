"""Make odometry messages for a car that publishes its odometry only as transforms."""

from collections import Counter
from typing import Any

import numpy as np

from racecar.pipelines.bags.converters.transform_odometry import TransformOdometryConverter
from racecar.pipelines.bags.converters.transforms import OdometryLinks
from racecar.pipelines.live.ros.messages import odometry_message, time_message

_UNKNOWN = np.zeros((3, 3))


class TransformOdometry:
    """Converts transforms to Odometry messages."""

    def __init__(self, links: OdometryLinks) -> None:
        self.links = links
        self._converter = TransformOdometryConverter(links, Counter())

    def message(self, transforms: Any) -> Any | None:
        """The equivalent Odometry message; None if there is nothing new on the car's motion."""
        stamp = self._converter.stamp_of(transforms)
        sample = None if stamp is None else self._converter.convert(transforms, stamp)
        if sample is None:
            return None
        frames = self.links.frames[0], self.links.base_frame
        return odometry_message(
            time_message(sample.stamp), *frames, sample.odom_from_base, _UNKNOWN, sample.twist
        )
