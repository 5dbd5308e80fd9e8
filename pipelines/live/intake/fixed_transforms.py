"""``/tf_static``: where things sit on the car, published once and kept for whoever comes later."""

import time
from collections.abc import Callable
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from racecar.pipelines.live.ros.transform_type import transform_message_type

_ASK_AGAIN_AFTER = 5.0
"""Seconds; on a busy car the first answer takes three."""
_QOS = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


class FixedTransforms:
    """Subscribes to ``/tf_static``.

    A late subscription is sent once what was published before. Now and then that is lost on the way; a new
    subscription is sent it again.
    """

    def __init__(self, node: Any, take: Callable[[bytes], None]) -> None:
        self._node, self._take = node, take
        self._subscribe()

    def ask_again(self) -> None:
        """Subscribe again, if the last time was long enough ago."""
        if time.monotonic() - self._asked > _ASK_AGAIN_AFTER:
            self._node.destroy_subscription(self._subscription)
            self._subscribe()

    def _subscribe(self) -> None:
        self._asked = time.monotonic()
        self._subscription = self._node.create_subscription(
            transform_message_type(), "/tf_static", self._take, _QOS, raw=True
        )
