"""The nodes' ROS parameters: declared with their meaning, checked, and changed while running."""

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError
from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterValueException

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.settings import Settings
from racecar.pipelines.bags.sensor_place import slip_in
from racecar.pipelines.files.nested_settings import leaf_fields, leaf_values, nested

SettingsT = TypeVar("SettingsT", bound=Settings)

_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
"""By pydantic's names."""


@dataclass(frozen=True)
class CarParameters:
    """What both nodes must know about the car; fixed once the node runs."""

    map_frame: str
    base_frame: str
    tf: str
    tf_base_frame: str
    transform_tolerance: float
    integrate_twist: bool
    laser_pose: Pose | None


_CAR: dict[str, tuple[Any, str]] = {
    "map_frame": ("map", "frame of the map, of all poses that are published"),
    "base_frame": ("base_link", "frame of the car, whose pose is published; transforms lead from here"),
    "tf": ("odom", "transform to publish: odom (map to odometry's frame), base (map to tf_base_frame), none"),
    "tf_base_frame": ("base_link_pf", "child frame of the transform where tf is base"),
    "transform_tolerance": (0.1, "seconds for which a transform is declared to hold beyond its time"),
    "odometry": ("pose", "what of /odom to believe: its pose, or its twist, which is integrated"),
    "laser_pose": ([0.0], "x, y (m) and yaw (rad) of the laser on the car; one 0 alone: as transforms say"),
}


def car_parameters(node: Any) -> CarParameters:
    """Declare and read what both nodes must know. Raises UserError that names a parameter at fault."""
    values = {
        name: declare(node, name, default, meaning, read_only=True)
        for name, (default, meaning) in _CAR.items()
    }
    _check_choice("tf", values["tf"], ("odom", "base", "none"))
    _check_choice("odometry", values["odometry"], ("pose", "twist"))
    tolerance = values["transform_tolerance"]
    if not isinstance(tolerance, int | float) or not 0.0 <= tolerance <= 10.0:
        raise UserError(f"The parameter transform_tolerance is {tolerance!r}; give seconds, 0 to 10.")
    return CarParameters(
        map_frame=str(values["map_frame"]),
        base_frame=str(values["base_frame"]),
        tf=values["tf"],
        tf_base_frame=str(values["tf_base_frame"]),
        transform_tolerance=float(tolerance),
        integrate_twist=values["odometry"] == "twist",
        laser_pose=_laser_pose(values["laser_pose"]),
    )


def declare(
    node: Any, name: str, default: Any, meaning: str, *, read_only: bool = False, **bounds: Any
) -> Any:
    """Declare a parameter, ``bounds`` being further fields of its descriptor, and return its value.

    Raises UserError that names it when the value given for it is out of bounds.
    """
    descriptor = ParameterDescriptor(description=meaning, read_only=read_only, dynamic_typing=True, **bounds)
    try:
        value = node.declare_parameter(name, default, descriptor).value
    except InvalidParameterValueException as error:
        raise UserError(f"The parameter {name} must be {descriptor.additional_constraints}.") from error
    return list(value) if isinstance(value, array) else value


def declare_positive(node: Any, name: str, default: float, meaning: str) -> float:
    """Declare a positive number that is fixed once the node runs. Raises UserError that names it when it is
    not one."""
    value = declare(node, name, default, meaning, read_only=True)
    if not isinstance(value, int | float) or not 0.0 < value <= 1000.0:
        raise UserError(f"The parameter {name} is {value!r}; give a positive number, 1000 at most.")
    return float(value)


def declare_settings(node: Any, settings: SettingsT) -> SettingsT:
    """Declare every setting as a parameter with its meaning and bounds, a nested one by its dotted name; the
    settings with what ROS overrides of them.

    Raises UserError that names a parameter at fault.
    """
    defaults = leaf_values(settings)
    values = {
        name: declare(node, name, defaults[name], str(field.description), **_bounds(field))
        for name, field in leaf_fields(type(settings))
    }
    return updated(settings, values)


def watch_settings(node: Any, current: Callable[[], SettingsT], apply: Callable[[SettingsT], None]) -> None:
    """Check parameters that are set while running, and hand new settings on; wrong ones are refused."""

    def check(parameters: Iterable[Any]) -> Any:
        settings = current()
        known = leaf_values(settings)
        changes = {parameter.name: parameter.value for parameter in parameters if parameter.name in known}
        if not changes:
            return SetParametersResult(successful=True)
        try:
            settings = updated(settings, changes)
        except UserError as error:
            return SetParametersResult(successful=False, reason=str(error))
        apply(settings)
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)


def updated(settings: SettingsT, changes: Mapping[str, Any]) -> SettingsT:
    """The settings with changes by dotted name. Raises UserError that names the one at fault."""
    values = {
        name: list(value) if isinstance(value, array) else value
        for name, value in {**leaf_values(settings), **changes}.items()
    }
    try:
        return type(settings).model_validate(nested(values))
    except ValidationError as error:
        raise UserError(f"{_sentence(error)}.") from error


def _bounds(field: FieldInfo) -> dict[str, Any]:
    """A setting's bounds as a parameter's descriptor states them: in words, and as a range where both ends
    are known."""
    found = {
        kind: getattr(constraint, kind)
        for constraint in field.metadata
        for kind in _BOUNDS
        if hasattr(constraint, kind)
    }
    bounds: dict[str, Any] = {
        "additional_constraints": ", ".join(f"{_BOUNDS[kind]} {value:g}" for kind, value in found.items())
    }
    low, high = found.get("ge", found.get("gt")), found.get("le", found.get("lt"))
    if low is None or high is None:
        return bounds
    if field.annotation is int:
        bounds["integer_range"] = [IntegerRange(from_value=low, to_value=high)]
    elif field.annotation is float:
        bounds["floating_point_range"] = [FloatingPointRange(from_value=float(low), to_value=float(high))]
    return bounds


def _sentence(error: ValidationError) -> str:
    first = error.errors()[0]
    name = ".".join(str(part) for part in first["loc"])
    return f"The parameter {name} is {first['input']!r}: {first['msg'][:1].lower()}{first['msg'][1:]}"


def _check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise UserError(f"The parameter {name} is {value!r}; it must be one of {', '.join(choices)}.")


def _laser_pose(value: Any) -> Pose | None:
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape == (1,) and numbers[0] == 0.0:
        return None
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise UserError(f"The parameter laser_pose is {value!r}; give x and y in metres and yaw in radians.")
    if (slip := slip_in(numbers.tolist())) is not None:
        raise UserError(f"The parameter laser_pose is {value!r}: {slip}.")
    return numbers
