"""Whoever drives a simulated car by topics, and watches where it truly is."""

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import ACKERMANN, nanoseconds, ros2_types
from tests.pipelines.live.live_car import wait_for


@dataclass
class Driver:
    """Sends goals and commands, and hears the truth."""

    node: Any
    namespace: str = ""
    truth: dict[int, Pose] = field(default_factory=dict)
    """``map_from_base`` by stamp."""
    speed: float = 0.0
    publishers: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        from nav_msgs.msg import Odometry as OdometryMessage

        self.node.create_subscription(OdometryMessage, f"{self.namespace}/ground_truth", self._hear, 1000)

    @property
    def place(self) -> Pose:
        """(3,) the latest."""
        return self.truth[max(self.truth)]

    def wait_until_driving(self, within: float, said: Any) -> None:
        """Until the simulator runs."""
        wait_for(lambda: bool(self.truth), within, said)

    def say(self, topic: str, message: Any) -> None:
        """Publish to whoever listens, waiting for it the first time."""
        before = self.publishers.get(topic)
        if before is not None and before.msg_type is not type(message):
            self.node.destroy_publisher(self.publishers.pop(topic))
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(
                type(message), f"{self.namespace}/{topic}", 10
            )
            wait_for(
                lambda: bool(self.publishers[topic].get_subscription_count()),
                10.0,
                lambda: f"nobody listens to {topic}",
            )
        self.publishers[topic].publish(message)

    def send_goal(self, goal: Pose, frame: str = "map") -> None:
        from geometry_msgs.msg import PoseStamped

        from racecar.pipelines.live.ros.messages import fill_pose

        message = PoseStamped()
        message.header.frame_id = frame
        fill_pose(message.pose, goal)
        self.say("goal_pose", message)

    def command(self, speed: float, turning: float, seconds: float, *, is_stamped: bool = False) -> None:
        """Say so again and again."""
        from geometry_msgs.msg import Twist, TwistStamped

        message = TwistStamped() if is_stamped else Twist()
        twist = message.twist if is_stamped else message
        twist.linear.x, twist.angular.z = speed, turning
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self.say("cmd_vel", message)
            time.sleep(0.05)

    def command_steering(self, speed: float, steering: float, seconds: float) -> None:
        """Say so again and again, as to race cars."""
        from racecar.pipelines.live.ros.message_types import message_class

        topic = f"{self.namespace}/drive"
        publisher = self.node.create_publisher(message_class(ACKERMANN), topic, 10)
        wait_for(lambda: bool(publisher.get_subscription_count()), 10.0, lambda: f"nobody listens to {topic}")
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            publisher.publish(ackermann_command(speed, steering))
            time.sleep(0.05)
        self.node.destroy_publisher(publisher)

    def distance_to(self, goal: Pose) -> float:
        return float(np.linalg.norm(self.place[:2] - goal[:2]))

    def _hear(self, message: Any) -> None:
        pose = planar_pose(message)
        assert pose is not None
        self.truth[nanoseconds(message.header.stamp)] = pose
        self.speed = message.twist.twist.linear.x


def ackermann_command(speed: float, steering: float) -> bytes:
    """A serialized AckermannDriveStamped."""
    types = ros2_types().types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    drive = types["ackermann_msgs/msg/AckermannDrive"](
        steering_angle=steering, steering_angle_velocity=0.0, speed=speed, acceleration=0.0, jerk=0.0
    )
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    return bytes(ros2_types().serialize_cdr(types[ACKERMANN](header=header, drive=drive), ACKERMANN))
