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
    found = _installed(package, "msg", kind)
    if found is not None:
        return found
    try:
        return declare_type(name) if name in DECLARED else None
    except (OSError, AttributeError, ImportError):
        return None


def service_class(package: str, kind: str) -> Any | None:
    """The class of a service such as ``std_srvs``, ``Empty``; None if this ROS lacks its package."""
    return _installed(package, "srv", kind)


def _installed(package: str, module: str, kind: str) -> Any | None:
    try:
        get_resource("rosidl_interfaces", package)
        return getattr(import_module(f"{package}.{module}"), kind, None)
    except (LookupError, OSError, ImportError):
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
