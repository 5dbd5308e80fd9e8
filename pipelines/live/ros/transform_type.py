"""The message type of ``/tf``, also where ROS came from PyPI, which has no package of it.

A car's ROS brings ``tf2_msgs``; then that is used. Otherwise the type is declared here from its one-line
definition, ``geometry_msgs/TransformStamped[] transforms``.
"""

from functools import cache
from typing import Any

from racecar.maps.errors import UserError
from racecar.pipelines.live.ros.declared_type import (
    FLOAT64,
    INT32,
    NESTED,
    NESTED_SEQUENCE,
    STRING,
    UINT32,
    Fields,
    declare_type,
)

_QUATERNION, _VECTOR = "geometry_msgs/msg/Quaternion", "geometry_msgs/msg/Vector3"
TRANSFORM_FIELDS: Fields = {
    "builtin_interfaces/msg/Time": [("sec", INT32, ""), ("nanosec", UINT32, "")],
    _QUATERNION: [(axis, FLOAT64, "") for axis in "xyzw"],
    "geometry_msgs/msg/Transform": [
        ("translation", NESTED, _VECTOR),
        ("rotation", NESTED, _QUATERNION),
    ],
    "geometry_msgs/msg/TransformStamped": [
        ("header", NESTED, "std_msgs/msg/Header"),
        ("child_frame_id", STRING, ""),
        ("transform", NESTED, "geometry_msgs/msg/Transform"),
    ],
    _VECTOR: [(axis, FLOAT64, "") for axis in "xyz"],
    "std_msgs/msg/Header": [("stamp", NESTED, "builtin_interfaces/msg/Time"), ("frame_id", STRING, "")],
    "tf2_msgs/msg/TFMessage": [("transforms", NESTED_SEQUENCE, "geometry_msgs/msg/TransformStamped")],
}


@cache
def transform_message_type() -> Any:
    """The class to name when publishing or subscribing; hand it serialized messages only.

    Raises UserError where there is neither ``tf2_msgs`` nor the ROS from which it can be declared.
    """
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return _declared()
    return TFMessage


def _declared() -> Any:
    try:
        return declare_type(TRANSFORM_FIELDS)
    except UserError as error:
        raise UserError(
            "This ROS has no package tf2_msgs, so transforms cannot be published; install it (with apt: "
            "ros-<distribution>-tf2-msgs), or set the parameter tf to none."
        ) from error
