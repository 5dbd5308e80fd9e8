"""What was told of the car before the node came reaches it, also where the first delivery was lost."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.pipelines.live.stage import wait_for


@pytest.fixture
def node() -> Iterator[Any]:
    from tests.pipelines.live.bus import ros_bus

    with ros_bus() as bus:
        yield bus.node("test_transform_topics")


def test_a_lost_delivery_is_asked_for_again(node: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecar.pipelines.live.intake import transform_topics
    from racecar.pipelines.live.ros.message_types import transform_message_type
    from racecar.pipelines.live.ros.messages import transform_bytes
    from racecar.pipelines.live.ros.qos import LATCHED

    told = transform_bytes(0, "base_link", "laser", [0.27, 0.0, 0.0])
    publisher = node.create_publisher(transform_message_type(), "/tf_static", LATCHED)
    publisher.publish(told)
    heard: list[bytes] = []
    is_lost = True
    transforms = transform_topics.TransformTopics(
        node, "/scan", lambda topic, data: heard.append(b"" if is_lost else bytes(data))
    )
    wait_for(lambda: bool(heard), lambda: "nothing came")
    is_lost = False
    transforms.ask_again()  # too soon
    time.sleep(1.0)
    assert heard == [b""]
    monkeypatch.setattr(transform_topics, "_ASK_AGAIN_AFTER", 0.0)
    transforms.ask_again()
    wait_for(lambda: len(heard) > 1, lambda: "nothing came again")
    assert heard == [b"", told]


def test_topics_of_the_own_robot_are_found_and_moving_ones_left_when_they_are_not_wanted(node: Any) -> None:
    from racecar.pipelines.live.intake.transform_topics import TransformTopics
    from racecar.pipelines.live.ros.message_types import transform_message_type
    from racecar.pipelines.live.ros.messages import transform_bytes
    from racecar.pipelines.live.ros.qos import LATCHED

    names = ["/tf", "/robot1/tf", "/robot1/tf_static", "/robot2/tf", "/robot2/tf_static"]
    publishers = {name: node.create_publisher(transform_message_type(), name, LATCHED) for name in names}
    heard: set[str] = set()

    def say_until_heard(*expected: str) -> None:
        def is_heard() -> bool:
            transforms.look(wants_moving=True)
            for publisher in publishers.values():
                publisher.publish(transform_bytes(0, "base_link", "laser", [0.27, 0.0, 0.0]))
            return heard >= set(expected)

        wait_for(is_heard, lambda: str(heard))

    transforms = TransformTopics(node, "/robot1/front/scan", lambda topic, data: heard.add(topic))
    say_until_heard("/tf", "/robot1/tf", "/robot1/tf_static")
    assert not any(name.startswith("/robot2") for name in heard)
    transforms.look(wants_moving=False)
    wait_for(lambda: not publishers["/robot1/tf"].get_subscription_count(), lambda: "still heard")
    assert publishers["/robot1/tf_static"].get_subscription_count()
