"""Message types by name, from ROS's message packages."""

import re
from functools import cache
from importlib import import_module
from typing import Any

from ament_index_python import get_resource

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import ACKERMANN, BOND, PARTICLE_CLOUD, TRANSFORMS
from racecar.pipelines.live.ros.declared_type import declare_type

_NAME = re.compile(r"([a-z][a-z0-9_]*)/msg/([A-Za-z][A-Za-z0-9]*)")
DECLARED = (TRANSFORMS, ACKERMANN, PARTICLE_CLOUD, BOND)
"""Types available without their packages, which a ROS from PyPI lacks; their messages are sent serialized."""


@cache
def message_class(name: str) -> Any | None:
    """The class of a type such as ``sensor_msgs/msg/LaserScan``; None if this ROS lacks it.

    Names from a bag are looked up among ROS's message packages only: no other module is ever imported.
    """
    parts = _NAME.fullmatch(name)
    if parts is None:
        return None
    package, kind = parts.groups()
    try:
        get_resource("rosidl_interfaces", package)
        return getattr(import_module(f"{package}.msg"), kind, None)
    except (LookupError, OSError, ImportError):
        pass
    try:
        return declare_type(name) if name in DECLARED else None
    except (OSError, AttributeError, ImportError):
        return None


def transform_message_type() -> Any:
    """The class for publishers and subscriptions of ``/tf``, for serialized messages only.

    Raises UserError if neither ``tf2_msgs`` nor the ROS from which it can be declared is available.
    """
    kind = message_class(TRANSFORMS)
    if kind is None:
        raise UserError(
            "This ROS has no package tf2_msgs, so transforms cannot be published; install it (with apt: "
            "ros-<distribution>-tf2-msgs), or set the parameter tf to none."
        )
    return kind
