"""The nodes' ROS parameters: declared with descriptions, validated, and changed at run time."""

from array import array
from collections.abc import Callable, Container, Iterable, Mapping
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import Field, field_validator
from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterValueException

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.nested_settings import leaf_fields, leaf_values, nested
from racecar.maps.settings import Settings, SettingsError
from racecar.pipelines.bags.car_frames import slip_in

SettingsT = TypeVar("SettingsT", bound=Settings)

_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
"""By pydantic's names."""


class CarParameters(Settings):
    """What both nodes must know about the car; fixed at run time."""

    map_frame: str = Field("map", description="frame of the map, of all poses that are published")
    base_frame: str = Field(
        "base_link", description="frame of the car, whose pose is published; transforms lead from here"
    )
    tf: Literal["odom", "base", "none"] = Field(
        "odom",
        description="transform to publish: odom (map to odometry's frame), base (map to tf_base_frame), none",
    )
    tf_base_frame: str = Field("base_link_pf", description="child frame of the transform where tf is base")
    transform_tolerance: float = Field(
        0.1, ge=0.0, le=10.0, description="seconds for which a transform is declared to hold beyond its time"
    )
    odometry: Literal["pose", "twist"] = Field(
        "pose", description="what of /odom to believe: its pose, or its twist, which is integrated"
    )
    scan_topic: str = Field("scan", description="topic of the scans, before remapping")
    laser_pose: tuple[float, ...] = Field(
        (0.0,), description="x, y (m) and yaw (rad) of the laser on the car; one 0 alone: as transforms say"
    )

    @field_validator("laser_pose")
    @classmethod
    def _check_place(cls, numbers: tuple[float, ...]) -> tuple[float, ...]:
        if numbers != (0.0,):
            if len(numbers) != 3:
                raise ValueError("give x and y in metres and yaw in radians")
            if (slip := slip_in(numbers)) is not None:
                raise ValueError(slip)
        return numbers

    @property
    def base_from_laser(self) -> Pose | None:
        """(3,) as given; None to use transforms."""
        return None if len(self.laser_pose) == 1 else np.array(self.laser_pose)


def declare_settings(
    node: Any, settings: SettingsT, *, read_only: bool = False, only: Container[str] | None = None
) -> SettingsT:
    """Declare each setting as a parameter with description and bounds, nested ones by dotted names; returns
    the settings with ROS's overrides. Those that are declared already keep their values. ``read_only``
    parameters are fixed at run time; ``only`` names those to declare, all by default.

    Raises UserError that names the invalid parameter.
    """
    defaults = leaf_values(settings)
    values = {
        name: _declared(node, name, defaults[name], field, read_only=read_only)
        for name, field in leaf_fields(type(settings))
        if only is None or name in only
    }
    return updated(settings, values)


def _declared(node: Any, name: str, default: Any, field: FieldInfo, *, read_only: bool) -> Any:
    """Declare a setting as a parameter and return its value.

    Raises UserError that names it when the value is out of bounds.
    """
    if node.has_parameter(name):
        return node.get_parameter(name).value
    descriptor = ParameterDescriptor(
        description=str(field.description), read_only=read_only, dynamic_typing=True, **_bounds(field)
    )
    try:
        return node.declare_parameter(name, default, descriptor).value
    except InvalidParameterValueException as error:
        raise UserError(f"The parameter {name} must be {descriptor.additional_constraints}.") from error


def watch_settings(node: Any, current: Callable[[], SettingsT], apply: Callable[[SettingsT], None]) -> None:
    """Validate parameters set at run time, and apply the new settings; invalid ones are rejected."""

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
    """The settings with changes by dotted name. Raises UserError that names the invalid one."""
    values = {
        name: list(value) if isinstance(value, array) else value
        for name, value in {**leaf_values(settings), **changes}.items()
    }
    try:
        return type(settings).model_validate(nested(values))
    except SettingsError as error:
        raise UserError(f"The parameter {error.name} has a bad value: {error.clause}.") from error


def _bounds(field: FieldInfo) -> dict[str, Any]:
    """A setting's bounds for a parameter descriptor: in words, and as a range if both bounds are known."""
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
