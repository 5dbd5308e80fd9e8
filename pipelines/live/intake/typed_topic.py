"""A topic that accepts several message types, and subscribes to the one that is published."""

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_topic_name import validate_topic_name

from racecar.maps.errors import UserError
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.qos import sensor_qos


class TypedTopic:
    """Subscribes with the published type, since a ROS 2 subscription receives one type only."""

    def __init__(
        self, node: Any, name: str, types: Sequence[str], take: Callable[[Any], None], depth: int
    ) -> None:
        """``name`` is subject to remapping. The first of ``types`` is subscribed to until another is
        published; ``depth`` is the queue size. Raises UserError if ROS has no such names."""
        self._node, self._types, self._take, self._depth = node, types, take, depth
        self.name: str = node.resolve_topic_name(_valid(name))
        """With remapping."""
        self.strange: list[str] = []
        """Published types, if none of them is supported."""
        self._subscription: Any = None
        self._type = ""
        self._listen_to(types[0])

    def look(self) -> bool:
        """Subscribe to the published type; returns whether there is one.

        If there are several, the first in ``types`` is used.
        """
        published = self._published()
        understood = [kind for kind in self._types if kind in published]
        self.strange = [] if understood else sorted(published)
        if understood:
            self._listen_to(understood[0])
        return bool(understood)

    @property
    def left_out(self) -> list[str]:
        """Types published besides the one subscribed to."""
        return sorted(self._published() - {self._type})

    def _published(self) -> set[str]:
        return {each.topic_type for each in self._node.get_publishers_info_by_topic(self.name)}

    def _listen_to(self, kind: str) -> None:
        """A process has one type per topic (Fast DDS), and a destroyed subscription lives until the callback
        ends; so the next one is created at the next look."""
        if self._subscription is None:
            self._subscription = self._node.create_subscription(
                message_class(kind), self.name, self._take, sensor_qos(self._depth)
            )
            self._type = kind
        elif kind != self._type:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None


def _valid(name: str) -> str:
    """Raises UserError if it is no name of a topic."""
    try:
        validate_topic_name(name)
    except InvalidTopicNameException as error:
        why = str(error).splitlines()[0]
        raise UserError(f"There can be no topic '{name}', so correct that parameter. {why}") from error
    return name
