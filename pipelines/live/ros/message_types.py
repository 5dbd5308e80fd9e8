"""Message types by name, among the packages that ROS knows to hold messages."""

import re
from importlib import import_module
from typing import Any

from ament_index_python import get_resource

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import ACKERMANN, TRANSFORMS
from racecar.pipelines.live.ros.ackermann_type import ackermann_message_type
from racecar.pipelines.live.ros.transform_type import transform_message_type

_NAME = re.compile(r"([a-z][a-z0-9_]*)/msg/([A-Za-z][A-Za-z0-9]*)")
_DECLARED = {TRANSFORMS: transform_message_type, ACKERMANN: ackermann_message_type}
"""Types that are there without their packages; their messages go serialized."""


def message_class(name: str) -> Any | None:
    """The class of a type such as ``sensor_msgs/msg/LaserScan``; None where this ROS does not have it.

    A name out of a bag is looked up among ROS's message packages only: no other module is ever imported.
    """
    if name in _DECLARED:
        try:
            return _DECLARED[name]()
        except UserError:
            return None
    parts = _NAME.fullmatch(name)
    if parts is None:
        return None
    package, kind = parts.groups()
    try:
        get_resource("rosidl_interfaces", package)
        return getattr(import_module(f"{package}.msg"), kind, None)
    except (LookupError, OSError, ImportError):
        return None
