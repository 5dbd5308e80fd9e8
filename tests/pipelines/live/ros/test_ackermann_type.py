"""Commands to cars that steer go over DDS also where ROS has no package of their type."""

import time

from racecar.pipelines.bags.messages import ACKERMANN, ros2_types
from tests.pipelines.live.simulated_driver import ackermann_command


def test_commands_go_over_dds_and_come_back() -> None:
    import rclpy

    from racecar.pipelines.live.ros.ackermann_type import ackermann_message_type
    from racecar.pipelines.live.ros.run import ros_node

    heard: list[bytes] = []
    with ros_node("test_commands", []) as node:
        kind = ackermann_message_type()
        publisher = node.create_publisher(kind, "/drive", 10)
        node.create_subscription(kind, "/drive", heard.append, 10, raw=True)
        until = time.monotonic() + 10.0
        while not heard and time.monotonic() < until:
            publisher.publish(ackermann_command(1.5, -0.25))
            rclpy.spin_once(node, timeout_sec=0.1)
        (told,) = node.get_publishers_info_by_topic("/drive")
        assert told.topic_type == ACKERMANN
        assert str(told.topic_type_hash) == ros2_types().hash_rihs01(ACKERMANN)
    command = ros2_types().deserialize_cdr(heard[0], ACKERMANN)
    assert (command.drive.speed, command.drive.steering_angle) == (1.5, -0.25)


def test_the_declared_type_is_the_one_of_the_definition() -> None:
    from racecar.pipelines.live.ros.ackermann_type import ACKERMANN_FIELDS
    from racecar.pipelines.live.ros.declared_type import type_hash

    assert f"RIHS01_{type_hash(ACKERMANN_FIELDS)}" == ros2_types().hash_rihs01(ACKERMANN)
