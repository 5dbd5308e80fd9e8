"""Whoever drives a simulated car by topics, and watches where it truly is."""

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import ACKERMANN, nanoseconds, ros2_types
from tests.pipelines.live.stage import wait_for


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

    def say(self, topic: str, message: Any, kind: Any = None) -> None:
        """Publish to whoever listens, waiting for it the first time; a serialized message is of a kind."""
        kind = kind or type(message)
        before = self.publishers.get(topic)
        if before is not None and before.msg_type is not kind:
            self.node.destroy_publisher(self.publishers.pop(topic))
        if topic not in self.publishers:
            publisher = self.publishers[topic] = self.node.create_publisher(
                kind, f"{self.namespace}/{topic}", 10
            )
            wait_for(
                lambda: bool(publisher.get_subscription_count()), lambda: f"nobody listens to {topic}", 30.0
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
        self._say_for(seconds, "cmd_vel", message)

    def command_steering(self, speed: float, steering: float, seconds: float) -> None:
        """Say so again and again, as to race cars."""
        from racecar.pipelines.live.ros.message_types import message_class

        self._say_for(seconds, "drive", ackermann_command(speed, steering), message_class(ACKERMANN))

    def _say_for(self, seconds: float, topic: str, message: Any, kind: Any = None) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self.say(topic, message, kind)
            time.sleep(0.05)

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
