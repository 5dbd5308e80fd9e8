"""A topic on which goes out what a person has clicked on the page."""

from collections.abc import Callable
from threading import Lock
from typing import Any

from racecar.maps.errors import UserError
from racecar.pipelines.live.ros.qos import is_heard

_UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""As ROS calls nodes of whom nothing but their topic has become known yet."""


class ClickedTopic:
    """Publishes until it is closed, and tells who listens; may be called by any thread."""

    def __init__(self, node: Any, kind: Any, name: str) -> None:
        self._node, self._lock = node, Lock()
        self._publisher = node.create_publisher(kind, name, 10)
        self._is_open = True
        self.name: str = self._publisher.topic_name
        """As it is called in the node's namespace, and by its remapping."""

    def publish(self, message: Callable[[Any], Any], remedy: str) -> str:
        """Publish a message made with the stamp of now; who listens, for people to read. Raises UserError
        when nobody does, with the remedy, or the node is ending."""
        with self._lock:
            if not self._is_open:
                raise UserError("Nothing is sent any more, as the node is ending.")
            if not is_heard(self._publisher):
                raise UserError(f"Nobody listens on {self.name}; {remedy}.")
            self._publisher.publish(message(self._node.get_clock().now().to_msg()))
            return self._listeners()

    def close(self) -> None:
        """Publish nothing any more."""
        with self._lock:
            self._is_open = False

    def _listeners(self) -> str:
        endpoints = self._node.get_subscriptions_info_by_topic(self.name)
        names = {f"{each.node_namespace}/{each.node_name}".lstrip("/") for each in endpoints}
        known = sorted(name for name in names if _UNKNOWN not in name)
        return f"{', '.join(known) or 'a node'} (on {self.name})"
