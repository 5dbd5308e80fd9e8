"""A topic on which messages of several types are understood: what is published there is listened to."""

from collections.abc import Callable, Sequence
from typing import Any

from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.qos import sensor_qos


class TypedTopic:
    """Subscribes with the type that somebody publishes; in ROS 2 a subscription hears one type only."""

    def __init__(
        self, node: Any, name: str, types: Sequence[str], take: Callable[[Any], None], depth: int
    ) -> None:
        """``name`` is remapped as ROS says. Of the ``types`` the first is listened to until another is
        published; ``depth``: how many messages may wait."""
        self._node, self._types, self._take, self._depth = node, types, take, depth
        self.name: str = node.resolve_topic_name(name)
        """As remapped."""
        self.strange: list[str] = []
        """Types that are published, where none of them is understood."""
        self._subscription: Any = None
        self._type = ""
        self._listen_to(types[0])

    def look(self) -> bool:
        """Listen to what is published now; whether anything is.

        Of several types the one named first is taken.
        """
        published = self._published()
        understood = [kind for kind in self._types if kind in published]
        self.strange = [] if understood else sorted(published)
        if understood:
            self._listen_to(understood[0])
        return bool(understood)

    @property
    def left_out(self) -> list[str]:
        """Types that are published beside the one that is listened to."""
        return sorted(self._published() - {self._type})

    def _published(self) -> set[str]:
        return {each.topic_type for each in self._node.get_publishers_info_by_topic(self.name)}

    def _listen_to(self, kind: str) -> None:
        """A process has one type for a topic (Fast DDS), and a subscription lives on until the callback ends
        that destroys it; so the next one is made at the next look."""
        if self._subscription is None:
            self._subscription = self._node.create_subscription(
                message_class(kind), self.name, self._take, sensor_qos(self._depth)
            )
            self._type = kind
        elif kind != self._type:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
