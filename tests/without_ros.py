"""``pytest -p tests.without_ros`` runs as where no ROS is installed: nothing of it is found."""

from importlib.machinery import ModuleSpec, PathFinder
from typing import Any

_ROS = ("rclpy", "ament_index_python")
_ROS_ENDINGS = ("_msgs", "_srvs", "_interfaces")

_find_any = PathFinder.find_spec


def _find_all_but_ros(name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
    package = name.split(".")[0]
    return None if package in _ROS or package.endswith(_ROS_ENDINGS) else _find_any(name, path, target)


PathFinder.find_spec = _find_all_but_ros  # type: ignore[method-assign,assignment]
