"""The message type of commands to cars that steer, also where ROS has no package ``ackermann_msgs``."""

from functools import cache
from typing import Any

from racecar.pipelines.live.ros.declared_type import (
    FLOAT32,
    INT32,
    NESTED,
    STRING,
    UINT32,
    Fields,
    declare_type,
)

ACKERMANN_FIELDS: Fields = {
    "ackermann_msgs/msg/AckermannDrive": [
        (name, FLOAT32, "")
        for name in ("steering_angle", "steering_angle_velocity", "speed", "acceleration", "jerk")
    ],
    "builtin_interfaces/msg/Time": [("sec", INT32, ""), ("nanosec", UINT32, "")],
    "std_msgs/msg/Header": [("stamp", NESTED, "builtin_interfaces/msg/Time"), ("frame_id", STRING, "")],
    "ackermann_msgs/msg/AckermannDriveStamped": [
        ("header", NESTED, "std_msgs/msg/Header"),
        ("drive", NESTED, "ackermann_msgs/msg/AckermannDrive"),
    ],
}


@cache
def ackermann_message_type() -> Any:
    """AckermannDriveStamped to name when publishing or subscribing; hand it serialized messages only.

    Raises UserError where there is neither ``ackermann_msgs`` nor the ROS from which it can be declared.
    """
    try:
        from ackermann_msgs.msg import AckermannDriveStamped
    except ImportError:
        return declare_type(ACKERMANN_FIELDS)
    return AckermannDriveStamped
