"""Types go out under their own names also where ROS has no packages of them."""

import time

import numpy as np
import pytest

from racecar.pipelines.bags.messages import ACKERMANN, BOND, PARTICLE_CLOUD, TRANSFORMS, ros2_types
from tests.pipelines.live.simulated_driver import ackermann_command


def there_and_back(name: str, message: bytes) -> bytes:
    """A message after it went over DDS."""
    import rclpy

    from racecar.pipelines.live.ros.declared_type import declare_type
    from racecar.pipelines.live.ros.run import ros_node

    heard: list[bytes] = []
    with ros_node("test_types", []) as node:
        kind = declare_type(name)
        publisher = node.create_publisher(kind, "/declared", 10)
        node.create_subscription(kind, "/declared", heard.append, 10, raw=True)
        until = time.monotonic() + 10.0
        while not heard and time.monotonic() < until:
            publisher.publish(message)
            rclpy.spin_once(node, timeout_sec=0.1)
        (told,) = node.get_publishers_info_by_topic("/declared")
        assert told.topic_type == name
        assert str(told.topic_type_hash) == ros2_types().hash_rihs01(name)
    return heard[0]


def test_transforms() -> None:
    from racecar.pipelines.live.ros.messages import transform_bytes

    sent = transform_bytes(5_000_000_007, "map", "odom", np.array([1.0, 2.0, 0.5]))
    (transform,) = ros2_types().deserialize_cdr(there_and_back(TRANSFORMS, sent), TRANSFORMS).transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "odom")
    assert (transform.header.stamp.sec, transform.header.stamp.nanosec) == (5, 7)
    assert transform.transform.translation.y == 2.0
    rotation = transform.transform.rotation
    assert 2 * np.arctan2(rotation.z, rotation.w) == pytest.approx(0.5, abs=1e-12)


def test_heartbeats_of_bonds() -> None:
    types = ros2_types().types
    stamp = types["builtin_interfaces/msg/Time"](sec=5, nanosec=7)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    sent = types[BOND](header, "racecar_mapper", "0b5e", True, 4.0, 0.5)
    received = there_and_back(BOND, bytes(ros2_types().serialize_cdr(sent, BOND)))
    assert ros2_types().deserialize_cdr(received, BOND) == sent


def test_commands_to_cars_that_steer() -> None:
    received = there_and_back(ACKERMANN, ackermann_command(1.5, -0.25))
    command = ros2_types().deserialize_cdr(received, ACKERMANN)
    assert (command.drive.speed, command.drive.steering_angle) == (1.5, -0.25)


@pytest.mark.parametrize("count", [1, 3])
def test_particles(count: int) -> None:
    from racecar.pipelines.live.ros.bulk_messages import particle_cloud_bytes
    from racecar.pipelines.live.ros.messages import time_message

    poses, weights = np.random.default_rng(count).normal(size=(count, 3)), np.linspace(0.0, 1.0, count)
    sent = particle_cloud_bytes(time_message(5_000_000_007), "robot/map", poses, weights)
    cloud = ros2_types().deserialize_cdr(there_and_back(PARTICLE_CLOUD, sent), PARTICLE_CLOUD)
    assert (cloud.header.frame_id, cloud.header.stamp.nanosec) == ("robot/map", 7)
    assert [particle.weight for particle in cloud.particles] == weights.tolist()
    for pose, particle in zip(poses, cloud.particles, strict=True):
        place, turn = particle.pose.position, particle.pose.orientation
        assert [place.x, place.y] == pose[:2].tolist()
        assert 2 * np.arctan2(turn.z, turn.w) == pytest.approx(pose[2])
