"""Play a bag to ROS 2: every message as recorded, at the recorded pace or another."""

import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from racecar.maps.errors import UserError
from racecar.pipelines.bags.converters.registry import SCAN_CONVERTERS
from racecar.pipelines.bags.messages import ros2_types
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import list_topics
from racecar.pipelines.live.ros.message_types import message_class
from racecar.pipelines.live.ros.messages import time_message

_LATCHED = ("/tf_static", "/map", "/robot_description")
_SETTLED = 3.2
"""Seconds without a new listener after which all are there: a process whose first announcement was missed
repeats it three seconds later (the default of Fast DDS)."""
_LONGEST_SLEEP = 0.1
"""Seconds, so that Ctrl-C is handled."""
_CLOCK_EVERY = 10_000_000
"""Nanoseconds of recording time."""


@dataclass
class Played:
    """Result of playing a bag."""

    messages: int = 0
    scans: int = 0
    latest: float = 0.0
    """Largest delay of a message in seconds."""


class Player:
    """Publishes a bag's topics through a ROS node."""

    def __init__(self, node: Any, path: Path, topics: Collection[str] = ()) -> None:
        """Opens the bag. By default all topics whose types this ROS has are played.

        Raises UserError when the path holds no bag or none of it can be played.
        """
        self._node = node
        self._store = BagStore(path)
        try:
            chosen = self._choose(topics)
            self.left_out = [topic for topic in chosen if message_class(topic.message_type) is None]
            """Topics of types that this ROS lacks."""
            self.topics = [topic for topic in chosen if topic not in self.left_out]
            if not self.topics:
                raise UserError(
                    f"Nothing in {path} can be played: it holds {list_topics(self._store.topics)}."
                )
        except BaseException:
            self._store.close()
            raise
        self._publishers = {topic.name: self._publisher(topic) for topic in self.topics}
        self._clock: Any | None = None
        for topic in self.topics:
            if topic.encoding == "ros1":
                ros2_types().get_msgdef(topic.message_type)  # so slow that the first messages would be late

    @property
    def message_count(self) -> int:
        """Number of messages to be played."""
        return sum(topic.message_count for topic in self.topics)

    def close(self) -> None:
        """Close the files."""
        self._store.close()

    def publish_clock(self) -> None:
        """Also publish ``/clock``, for nodes with the parameter use_sim_time."""
        self._clock = self._node.create_publisher(Clock, "/clock", 10)

    def wait_for_listeners(self, seconds: float, listeners: int | None = None) -> bool:
        """Wait, for ``seconds`` at most, for a subscriber to the scans, and then for all that follow soon, or
        for ``listeners`` of them; returns whether there is any."""
        scans = [topic for topic in self.topics if topic.message_type in SCAN_CONVERTERS]
        publishers = [self._publishers[topic.name] for topic in scans or self.topics]
        began = since = time.monotonic()
        known = 0
        while True:
            now = time.monotonic()
            hearing: int = sum(one.get_subscription_count() for one in publishers)
            if hearing != known:
                known, since = hearing, now
            are_all_there = now - since >= _SETTLED if listeners is None else hearing >= listeners
            is_over = now - began > seconds and (hearing == 0 or listeners is not None)
            if (hearing and are_all_there) or is_over:
                return hearing > 0
            time.sleep(0.02)

    def play(self, speed: float, progress: Callable[[int], None] = lambda count: None) -> Played:
        """Publish everything, ``speed`` times as fast as recorded."""
        played = Played()
        started, first, clock = time.monotonic(), None, 0
        for topic, recorded, data in self._messages():
            first = recorded if first is None else first
            due = started + (recorded - first) * 1e-9 / speed
            played.latest = max(played.latest, _sleep_until(due))
            if self._clock is not None and recorded >= clock:
                self._clock.publish(Clock(clock=time_message(recorded)))
                clock = recorded + _CLOCK_EVERY
            self._publishers[topic.name].publish(data)
            played.messages += 1
            played.scans += topic.message_type in SCAN_CONVERTERS
            progress(played.messages)
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=1))
        return played

    def _choose(self, names: Collection[str]) -> list[BagTopic]:
        topics = self._store.topics
        for name in names:
            if name not in topics:
                raise UserError(
                    f"There is no topic {name} in {self._store.path}; it holds {list_topics(topics)}."
                )
        return [topic for topic in topics.values() if not names or topic.name in names]

    def _publisher(self, topic: BagTopic) -> Any:
        durability = DurabilityPolicy.TRANSIENT_LOCAL if topic.name in _LATCHED else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=durability)
        return self._node.create_publisher(message_class(topic.message_type), topic.name, qos)

    def _messages(self) -> Iterator[tuple[BagTopic, int, bytes]]:
        """Topic, recording time in nanoseconds, and the message as ROS 2 serializes it."""
        by_name = {topic.name: topic for topic in self.topics}
        for name, recorded, data in self._store.messages(list(by_name)):
            topic = by_name[name]
            is_ros1 = topic.encoding == "ros1"
            yield (
                topic,
                recorded,
                bytes(ros2_types().ros1_to_cdr(data, topic.message_type)) if is_ros1 else data,
            )


def _sleep_until(due: float) -> float:
    """Sleep until a time; returns the seconds since then if it is already past."""
    while (left := due - time.monotonic()) > 0.0:
        time.sleep(min(left, _LONGEST_SLEEP))
    return -left
