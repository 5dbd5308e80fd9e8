"""Where a bag's sensor sits on the car: given by the user, found in the bag's transforms, or assumed."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.pipelines.bags.converters.transforms import SensorPlace, TransformTree
from racecar.pipelines.bags.findings import Finding

BASE_FRAMES = ("base_link", "base_footprint")
"""Of a car, as REP 105 and REP 120 name them."""
_LARGEST_TILT = np.radians(10)
"""Above which a planar scan is misleading, since 10° put a wall 5 m away 9 cm too far: by judgement."""


def find_place(
    sensor_frame: str,
    base_frames: Sequence[str],
    static_transforms: Iterable[Any],
    given: Pose | None,
    findings: list[Finding],
) -> SensorPlace:
    """The place of the sensor in the first of the base frames from which a transform leads to it.

    ``given`` (3,) overrides the bag's ``static_transforms`` (TransformStamped). What is doubtful goes into
    the ``findings``.
    """
    if given is not None:
        return SensorPlace.from_pose(given, "flag")
    tree = TransformTree()
    for transform in static_transforms:
        tree.add(transform)
    for base in base_frames:
        base_from_sensor = tree.between(base, sensor_frame)
        if base_from_sensor is not None and base != sensor_frame:
            place = SensorPlace(base_from_sensor, "tf_static")
            _check_tilt(place, findings)
            return place
    if sensor_frame in base_frames:
        return SensorPlace.from_pose(IDENTITY, "base frame")
    findings.append(
        Finding(
            f"The bag does not say where {sensor_frame or 'the sensor'} sits on the car (no transform from "
            "base_link in /tf_static): it is taken to be at base_link.",
            "Give it with --laser-pose X Y YAW, or record /tf_static.",
        )
    )
    return SensorPlace.from_pose(IDENTITY, "assumed identity")


def _check_tilt(place: SensorPlace, findings: list[Finding]) -> None:
    if place.tilt > _LARGEST_TILT:
        findings.append(
            Finding(
                f"The sensor is tilted by {np.degrees(place.tilt):.0f}°: it is taken as level.",
                "Mount it level; else walls appear too far and the floor as a wall.",
                spoils_map=True,
            )
        )
