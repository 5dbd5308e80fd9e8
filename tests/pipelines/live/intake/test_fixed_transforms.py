"""What was told of the car before the node came reaches it, also where the first delivery was lost."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.pipelines.live.live_car import wait_for


@pytest.fixture
def node() -> Iterator[Any]:
    from racecar.pipelines.live.ros.run import ros_node, served

    with ros_node("test_fixed_transforms", []) as node, served(node):
        yield node


def test_a_lost_delivery_is_asked_for_again(node: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecar.pipelines.live.intake import fixed_transforms
    from racecar.pipelines.live.ros.messages import transform_bytes
    from racecar.pipelines.live.ros.qos import LATCHED
    from racecar.pipelines.live.ros.transform_type import transform_message_type

    told = transform_bytes(0, "base_link", "laser", [0.27, 0.0, 0.0])
    publisher = node.create_publisher(transform_message_type(), "/tf_static", LATCHED)
    publisher.publish(told)
    heard: list[bytes] = []
    is_lost = True
    transforms = fixed_transforms.FixedTransforms(
        node, lambda data: heard.append(b"" if is_lost else bytes(data))
    )
    wait_for(lambda: bool(heard), 10.0, lambda: "nothing came")
    is_lost = False
    transforms.ask_again()  # too soon
    time.sleep(1.0)
    assert heard == [b""]
    monkeypatch.setattr(fixed_transforms, "_ASK_AGAIN_AFTER", 0.0)
    transforms.ask_again()
    wait_for(lambda: len(heard) > 1, 10.0, lambda: "nothing came again")
    assert heard == [b"", told]
