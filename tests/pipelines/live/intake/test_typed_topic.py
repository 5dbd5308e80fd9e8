"""Topics whose names ROS cannot have."""

from unittest.mock import Mock

import pytest

from racecar.maps.errors import UserError


@pytest.mark.parametrize("name", ["", "my scan", "scan/"])
def test_a_topic_that_ros_cannot_have_is_one_sentence(name: str) -> None:
    from racecar.pipelines.live.intake.typed_topic import TypedTopic

    said = f"There can be no topic '{name}', so correct that parameter. Invalid topic name"
    with pytest.raises(UserError, match=said):
        TypedTopic(Mock(), name, ["sensor_msgs/msg/LaserScan"], Mock(), 1)
