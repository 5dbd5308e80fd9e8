"""/tf goes out under its own name also where ROS has no package of its type."""

import time

import numpy as np

from racecar.pipelines.bags.messages import TRANSFORMS, ros2_types


def test_transforms_go_over_dds_and_come_back() -> None:
    import rclpy

    from racecar.pipelines.live.ros.messages import transform_bytes
    from racecar.pipelines.live.ros.run import ros_node
    from racecar.pipelines.live.ros.transform_type import transform_message_type

    heard: list[bytes] = []
    with ros_node("test_transforms", []) as node:
        kind = transform_message_type()
        publisher = node.create_publisher(kind, "/tf", 10)
        node.create_subscription(kind, "/tf", heard.append, 10, raw=True)
        until = time.monotonic() + 10.0
        while not heard and time.monotonic() < until:
            publisher.publish(transform_bytes(5_000_000_007, "map", "odom", np.array([1.0, 2.0, 0.5])))
            rclpy.spin_once(node, timeout_sec=0.1)
        (told,) = node.get_publishers_info_by_topic("/tf")
        assert told.topic_type == TRANSFORMS
        assert str(told.topic_type_hash) == ros2_types().hash_rihs01(TRANSFORMS)
    (transform,) = ros2_types().deserialize_cdr(heard[0], TRANSFORMS).transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "odom")
    assert (transform.header.stamp.sec, transform.header.stamp.nanosec) == (5, 7)
    assert transform.transform.translation.y == 2.0
    assert 2 * np.arctan2(transform.transform.rotation.z, transform.transform.rotation.w) == 0.5


def test_the_declared_type_is_the_one_that_the_bags_have() -> None:
    from racecar.pipelines.live.ros.declared_type import type_hash
    from racecar.pipelines.live.ros.transform_type import TRANSFORM_FIELDS

    assert f"RIHS01_{type_hash(TRANSFORM_FIELDS)}" == ros2_types().hash_rihs01(TRANSFORMS)
