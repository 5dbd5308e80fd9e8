"""Where a bag's sensors sit on the car: given by the user, found in the bag's transforms, or assumed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.pipelines.bags.converters.transforms import (
    BASE_FRAMES,
    FrameLinks,
    SensorPlace,
    TransformTree,
    last_name,
    seen_from_above,
)
from racecar.sensors.findings import Finding

_LARGEST_TILT = np.radians(10)
"""Above which a planar scan is misleading, since 10° put a wall 5 m away 9 cm too far: by judgement."""
_SAME_PLACE = 0.01
"""Metres or radians within which two places are one: far below what blurs a map, by judgement."""


@dataclass(eq=False)
class SensorPlaces:
    """Finds the place of each sensor by the name of its frame; what is doubtful goes into the findings."""

    links: FrameLinks
    odometry_child: str
    """The frame whose motion odometry tells; empty where it does not say."""
    given: Pose | None
    """(3,) overrides the links."""
    findings: list[Finding]
    _found: dict[str, tuple[SensorPlace, str]] = field(default_factory=dict)

    def place(self, sensor_frame: str) -> SensorPlace:
        """Where a sensor sits in the frame of the base."""
        return self._find(sensor_frame)[0]

    def base_frame(self, sensor_frame: str) -> str:
        """The frame that stands for the car where this sensor is concerned; empty where none is known."""
        return self._find(sensor_frame)[1]

    @property
    def frames(self) -> dict[str, SensorPlace]:
        """All that were asked for so far."""
        return {frame: place for frame, (place, _) in self._found.items()}

    def _find(self, sensor_frame: str) -> tuple[SensorPlace, str]:
        if sensor_frame not in self._found:
            self._found[sensor_frame] = self._look_up(sensor_frame)
        return self._found[sensor_frame]

    def _look_up(self, sensor_frame: str) -> tuple[SensorPlace, str]:
        tree = self.links.fixed()
        base = base_frame_of(tree, sensor_frame, self.odometry_child)
        if self.given is not None:
            return SensorPlace.from_pose(self.given, "flag"), base or BASE_FRAMES[0]
        if base is None:
            self.findings.append(Finding("place_unknown", sensor=sensor_frame or "the sensor"))
            return SensorPlace.from_pose(IDENTITY, "assumed identity"), ""
        if base == sensor_frame:
            return SensorPlace.from_pose(IDENTITY, "base frame"), base
        matrix = tree.around(base)[sensor_frame]
        place = SensorPlace(matrix, self._source(sensor_frame, base))
        if last_name(base) not in BASE_FRAMES and base != self.odometry_child:
            self.findings.append(Finding("place_by_another_frame", sensor=sensor_frame, base=base))
        self._check_contradiction(sensor_frame, base, place)
        self._check_circles(sensor_frame, base, place)
        if place.tilt > _LARGEST_TILT:
            self.findings.append(Finding("sensor_tilted", spoils_map=True, degrees=np.degrees(place.tilt)))
        return place, base

    def _source(self, sensor_frame: str, base: str) -> str:
        """``tf_static`` where latched links lead from the base to the sensor, or else ``tf``."""
        latched = TransformTree()
        for link in self.links:
            if link.is_latched:
                latched.link(link.parent, link.child, link.latest)
        return "tf" if latched.between(base, sensor_frame) is None else "tf_static"

    def _check_contradiction(self, sensor_frame: str, base: str, place: SensorPlace) -> None:
        other = self.links.fixed()
        for (parent, child), pose in self.links.contradicted.items():
            other.link(parent, child, pose)
        matrix = other.between(base, sensor_frame)
        if matrix is not None and _are_two_places(place.base_from_sensor, matrix):
            self.findings.append(
                Finding(
                    "place_told_twice",
                    sensor=sensor_frame,
                    other=in_words(seen_from_above(matrix)),
                    place=in_words(place.pose),
                )
            )

    def _check_circles(self, sensor_frame: str, base: str, place: SensorPlace) -> None:
        for link, matrix in self.links.circles(base, sensor_frame):
            if _are_two_places(place.base_from_sensor, matrix):
                self.findings.append(
                    Finding(
                        "transforms_in_a_circle",
                        link=str(link),
                        sensor=sensor_frame,
                        other=in_words(seen_from_above(matrix)),
                        place=in_words(place.pose),
                    )
                )


def _are_two_places(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    x, y, yaw = seen_from_above(np.linalg.inv(first) @ second)
    return bool(np.hypot(x, y) > _SAME_PLACE or abs(yaw) > _SAME_PLACE)


def slip_in(place: Sequence[float]) -> str | None:
    """What is wrong with a place that somebody gave, (3,) or with a roll (4,), as the end of a sentence."""
    yaw, roll = place[2], [*place, 0.0][3]
    for name, angle in (("yaw", yaw), ("roll", roll)):
        if abs(angle) > 2.0 * np.pi:
            return (
                f"a {name} of {angle:g} goes round more than once: give radians, {np.radians(angle):.4f} if "
                "these are degrees"
            )
    if abs(np.sin(roll)) > np.sin(_LARGEST_TILT):
        return (
            f"a roll of {roll:g} ({np.degrees(roll):.0f}°) tilts the laser: a planar one hangs upright, "
            "without a roll, or upside down, 3.1416"
        )
    return None


def base_frame_of(tree: TransformTree, sensor_frame: str, odometry_child: str) -> str | None:
    """The frame that stands for the car, among those fixed to a sensor; None where nothing tells.

    One with a standard name, in whatever namespace; but that whose motion odometry tells, where both are not
    one place seen from above. Without either, the frame from which all others hang.
    """
    around = tree.around(sensor_frame)
    standard = [frame for name in BASE_FRAMES for frame in around if last_name(frame) == name]
    if odometry_child in around:
        if not standard:
            return odometry_child
        offset = seen_from_above(np.linalg.inv(around[standard[0]]) @ around[odometry_child])
        return standard[0] if np.abs(offset).max() < _SAME_PLACE else odometry_child
    if standard:
        return standard[0]
    top = tree.top(sensor_frame)
    return None if top == sensor_frame else top


def in_words(pose: Pose) -> str:
    """A place (3,) for people."""
    return f"x {pose[0]:.2f} m, y {pose[1]:.2f} m, yaw {np.degrees(pose[2]):.0f}°"
