"""Odometry of a car that publishes none but in its transforms, as messages like those of other cars."""

from collections import Counter
from typing import Any

import numpy as np

from racecar.pipelines.bags.converters.transform_odometry import TransformOdometryConverter
from racecar.pipelines.bags.converters.transforms import OdometryLinks
from racecar.pipelines.live.ros.messages import odometry_message, time_message

_UNKNOWN = np.zeros((3, 3))


class TransformOdometry:
    """Makes Odometry messages of messages with transforms."""

    def __init__(self, links: OdometryLinks) -> None:
        self.links = links
        self._converter = TransformOdometryConverter(links, Counter())

    def message(self, transforms: Any) -> Any | None:
        """The Odometry message that says the same; None where nothing new of the car's motion is said."""
        stamp = self._converter.stamp_of(transforms)
        sample = None if stamp is None else self._converter.convert(transforms, stamp)
        if sample is None:
            return None
        frames = self.links.frames[0], self.links.base_frame
        return odometry_message(
            time_message(sample.stamp), *frames, sample.odom_from_base, _UNKNOWN, sample.twist
        )
