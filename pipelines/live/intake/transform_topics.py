"""``/tf_static`` and ``/tf``: the places of the sensors, and the car's motion if there is no other source."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from racecar.pipelines.bags.converters.transforms import is_latched, namespace_of
from racecar.pipelines.bags.messages import TRANSFORMS
from racecar.pipelines.live.ros.message_types import transform_message_type

_ASK_AGAIN_AFTER = 5.0
"""Seconds; on a busy car the first answer takes three."""
_FIXED = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
_MOVING = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
)


class TransformTopics:
    """Subscribes to transform topics: those at the root, and those in the namespaces of the scans' topic,
    since several robots may publish links with the same names.

    Late subscribers are sent latched messages. These get lost now and then; a new subscription is sent them
    again.
    """

    def __init__(self, node: Any, scan_topic: str, take: Callable[[str, bytes], None]) -> None:
        """``take`` receives the topic and the serialized message."""
        self._node, self._scan_topic, self._take = node, scan_topic, take
        self._subscriptions: dict[str, Any] = {}
        self._listen(node.resolve_topic_name("/tf_static"))
        self._listen(node.resolve_topic_name("/tf"))

    def look(self, *, wants_moving: bool) -> None:
        """Subscribe to new topics; those with links that may move only while they are wanted, since they
        carry hundreds of messages a second."""
        root = [self._node.resolve_topic_name(name) for name in ("/tf_static", "/tf")]
        found = [
            name
            for name, types in self._node.get_topic_names_and_types()
            if TRANSFORMS in types and self._scan_topic.startswith(namespace_of(name) + "/")
        ]
        for name in {*root, *found}:
            if is_latched(name) or wants_moving:
                self._listen(name)
            elif name in self._subscriptions:
                self._node.destroy_subscription(self._subscriptions.pop(name))

    def ask_again(self) -> None:
        """Subscribe again to latched messages, if the last time was long enough ago."""
        if time.monotonic() - self._asked <= _ASK_AGAIN_AFTER:
            return
        for name in [name for name in self._subscriptions if is_latched(name)]:
            self._node.destroy_subscription(self._subscriptions.pop(name))
            self._listen(name)

    def _listen(self, name: str) -> None:
        if name in self._subscriptions:
            return
        qos = _FIXED if is_latched(name) else _MOVING
        if is_latched(name):
            self._asked = time.monotonic()
        self._subscriptions[name] = self._node.create_subscription(
            transform_message_type(), name, partial(self._take, name), qos, raw=True
        )
