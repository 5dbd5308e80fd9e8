"""Frames of the car and where its sensors sit, from a bag or from transforms published live."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import angle_slip
from racecar.pipelines.bags.converters.transforms import (
    BASE_FRAMES,
    FrameLinks,
    OdometryLinks,
    SensorPlace,
    TransformTree,
    last_name,
    seen_from_above,
)
from racecar.sensors.findings import Finding, in_words

_LARGEST_TILT = np.radians(10)
"""Largest tilt of a planar scan: 10° put a wall 5 m away 9 cm too far. Chosen by judgement."""
_SAME_PLACE = 0.01
"""Metres or radians within which two places are the same. Chosen by judgement: too little to blur a map."""

_FARTHEST = 20.0
"""Metres from the base to a laser: an error, since no car is as long. Chosen by judgement."""


class CarFrames:
    """Links that have not changed so far count as fixed, on any topic. Thread-safe."""

    def __init__(
        self,
        given: Iterable[float] | None = None,
        given_by: str = "given",
        base_frame: str = BASE_FRAMES[0],
        links: FrameLinks | None = None,
    ) -> None:
        """``given`` (3,), or (4,) with a roll, overrides the links at which sensors sit; ``given_by`` names
        its source for users. With an unusual ``base_frame``, no other frame counts as the base. ``links`` are
        those known already."""
        self._given, self._given_by, self._base_frame = given, given_by, base_frame
        self._lock = Lock()
        self.links = links or FrameLinks()
        self._states: dict[tuple[str, str], tuple[bool, int, bool]] = {}
        """For each link: whether it moves, its corrections, and whether another topic contradicts it."""
        self._odometry_child = ""
        self._places: dict[str, SensorPlace] = {}
        self.version = 0
        """Incremented when places may have changed."""

    def take(self, message: Any, topic: str) -> None:
        """Add a message with transforms."""
        with self._lock:
            for transform in message.transforms:
                link = self.links.add(transform, topic)
                if link is None:
                    continue
                changes = link.changes if link.is_mended else 0
                state = link.moves, changes, link.ends in self.links.contradicted
                if link.count == 1 or self._states[link.ends] != state:
                    self._states[link.ends] = state
                    self._change()

    def name_odometry_child(self, frame: str) -> None:
        """Set the frame whose motion the odometry reports; empty if it names none."""
        if frame != self._odometry_child:
            self._odometry_child = frame
            self._change()

    def placed(self, sensor_frame: str) -> SensorPlace:
        """Place of a sensor in the base frame; at its origin if unknown."""
        with self._lock:
            if sensor_frame not in self._places:
                self._places[sensor_frame] = self._look_up(sensor_frame)
            return self._places[sensor_frame]

    @property
    def places(self) -> dict[str, SensorPlace]:
        """Places of all sensors looked up so far, by frame."""
        return dict(self._places)

    def between(self, target: str, source: str) -> NDArray[np.float64] | None:
        """``target_from_source`` (4, 4); None if the frames are not fixed to each other."""
        with self._lock:
            return self.links.fixed().between(target, source)

    def odometry(self, sensor_frame: str) -> OdometryLinks | None:
        """The links that form the odometry, once they have moved."""
        with self._lock:
            found = self.links.odometry(sensor_frame)
        return found if found is not None and found.driving.moves else None

    def _change(self) -> None:
        self.version += 1
        self._places.clear()

    def _look_up(self, sensor_frame: str) -> SensorPlace:
        tree, base = self.links.fixed(), self._base_frame
        if base == BASE_FRAMES[0]:
            base = base_frame_of(tree, sensor_frame, self._odometry_child) or ""
        if self._given is not None:
            given = SensorPlace.from_pose(self._given, self._given_by)
            return replace(given, base_frame=base or self._base_frame, is_sure=True)
        matrix = tree.between(base, sensor_frame) if base else None
        if matrix is None:
            unknown = Finding("place_unknown", sensor=sensor_frame or "the sensor")
            return SensorPlace(np.eye(4), "assumed identity", findings=(unknown,))
        source = "base frame" if base == sensor_frame else self._source(sensor_frame, base)
        is_sure = last_name(base) in BASE_FRAMES or base in (self._odometry_child, self._base_frame)
        place = SensorPlace(matrix, source, base, is_sure)
        if base == sensor_frame:
            return place
        other = self._by_others(base, sensor_frame)
        rival = None if other is None or not _are_two_places(matrix, other) else seen_from_above(other)
        return replace(place, findings=self._doubts(sensor_frame, place), rival=rival)

    def _by_others(self, base: str, sensor_frame: str) -> NDArray[np.float64] | None:
        """``base_from_sensor`` (4, 4) if other transforms for its links are used."""
        others = self.links.fixed()
        for (parent, child), pose in self.links.contradicted.items():
            others.link(parent, child, pose)
        return others.between(base, sensor_frame)

    def _source(self, sensor_frame: str, base: str) -> str:
        """``tf_static`` if latched links connect the base to the sensor, else ``tf``."""
        latched = TransformTree()
        for link in self.links:
            if link.is_latched:
                latched.link(link.parent, link.child, link.latest)
        return "tf" if latched.between(base, sensor_frame) is None else "tf_static"

    def _doubts(self, sensor_frame: str, place: SensorPlace) -> tuple[Finding, ...]:
        """Doubts about a place taken from links."""
        findings, base = list[Finding](), place.base_frame
        if not place.is_sure:
            findings.append(Finding("place_by_another_frame", sensor=sensor_frame, base=base))
        told = [("place_told_twice", "", self._by_others(base, sensor_frame))]
        for link, matrix in self.links.circles(base, sensor_frame):
            told.append(("transforms_in_a_circle", str(link), matrix))
        for name, by, other in told:
            if other is not None and _are_two_places(place.base_from_sensor, other):
                elsewhere, here = in_words(seen_from_above(other)), in_words(place.pose)
                findings.append(Finding(name, sensor=sensor_frame, link=by, other=elsewhere, place=here))
        if place.tilt > _LARGEST_TILT:
            findings.append(Finding("sensor_tilted", spoils_map=True, degrees=np.degrees(place.tilt)))
        return tuple(findings)


def _are_two_places(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    x, y, yaw = seen_from_above(np.linalg.inv(first) @ second)
    return bool(np.hypot(x, y) > _SAME_PLACE or abs(yaw) > _SAME_PLACE)


def given_place(place: ArrayLike) -> tuple[float, ...]:
    """The place of a laser as a caller gave it: x, y, yaw and perhaps roll. Raises UserError."""
    try:
        numbers = tuple(np.atleast_1d(np.asarray(place, dtype=np.float64)).tolist())
    except (TypeError, ValueError):
        numbers = ()
    if (slip := slip_in(numbers)) is not None:
        raise UserError(f"The laser_pose {place!r} is not a place: {slip}.")
    return numbers


def slip_in(place: Sequence[float]) -> str | None:
    """What is wrong with a place that a user gave, (3,) or (4,) with a roll, as the end of a sentence."""
    if np.shape(place) not in ((3,), (4,)) or not np.isfinite(place).all():
        return "give x, y and yaw in metres and radians, and the roll, 3.1416, if the laser hangs upside down"
    if (far := max(abs(place[0]), abs(place[1]))) > _FARTHEST:
        return f"{far:g} m is beyond any car: give metres, {far / 1000:g} if these are millimetres"
    yaw, roll = place[2], [*place, 0.0][3]
    for name, angle in (("yaw", yaw), ("roll", roll)):
        if (slip := angle_slip(name, angle)) is not None:
            return slip
    if abs(np.sin(roll)) > np.sin(_LARGEST_TILT):
        return (
            f"a roll of {roll:g} ({np.degrees(roll):.0f}°) tilts the laser: a planar one hangs upright, "
            "without a roll, or upside down, 3.1416"
        )
    return None


def base_frame_of(tree: TransformTree, sensor_frame: str, odometry_child: str) -> str | None:
    """The frame that stands for the car, among those fixed to a sensor; None if unknown.

    Usually the one with a standard name, in any namespace. The child frame of odometry wins if it is at
    another place seen from above. Without either, the root of the tree.
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
