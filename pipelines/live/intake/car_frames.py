"""The frames of the car and the links between them, as they are published while it drives."""

from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.pipelines.bags.converters.transforms import (
    BASE_FRAMES,
    FrameLinks,
    OdometryLinks,
    SensorPlace,
    last_name,
)
from racecar.pipelines.bags.frames import is_latched
from racecar.pipelines.bags.sensor_place import SensorPlaces
from racecar.sensors.findings import Finding


@dataclass(frozen=True, eq=False)
class Placed:
    """A sensor on the car."""

    place: SensorPlace
    base_frame: str
    """The frame that stands for the car."""
    is_sure: bool
    """Whether that frame is known to be the car's."""
    findings: tuple[Finding, ...] = ()


class CarFrames:
    """Links that never changed so far are fixed, on whatever topic, and so are those that were put right; may
    be used in several threads."""

    def __init__(self, base_frame: str, laser_pose: Pose | None) -> None:
        """``base_frame``: where it is not the usual name, no other frame counts; ``laser_pose`` (3,)
        overrides what is published."""
        self._base_frame, self._laser_pose = base_frame, laser_pose
        self._lock = Lock()
        self._links = FrameLinks(takes_mended=True)
        self._known: dict[tuple[str, str], tuple[bool, int]] = {}
        """Of each link whether it moves, and how often it was put right."""
        self._odometry_child = ""
        self.version = 0
        """Grows when places may have changed."""

    def take(self, message: Any, topic: str) -> None:
        """A message with transforms."""
        latched = is_latched(topic)
        with self._lock:
            for transform in message.transforms:
                link = self._links.add(transform, topic, is_latched=latched)
                if link is None:
                    continue
                ends = link.parent, link.child
                how = link.moves, link.changes if link.is_mended else 0
                if self._known.get(ends, (False, 0)) != how:
                    self._known[ends] = how
                    self.version += 1
                self.version += link.count == 1

    def name_odometry_child(self, frame: str) -> None:
        """The frame whose motion odometry tells."""
        if frame != self._odometry_child:
            self._odometry_child = frame
            self.version += 1

    def placed(self, sensor_frame: str) -> Placed | None:
        """Where a sensor sits; None where nothing tells."""
        if self._laser_pose is not None:
            place = SensorPlace.from_pose(self._laser_pose, "the parameter laser_pose")
            base = self._published_base(sensor_frame) or self._base_frame
            return Placed(place, base, is_sure=True)
        if self._base_frame != BASE_FRAMES[0]:
            return self._on_given_base(sensor_frame)
        findings: list[Finding] = []
        with self._lock:
            places = SensorPlaces(self._links, self._odometry_child, None, findings)
            place, base = places.place(sensor_frame), places.base_frame(sensor_frame)
        if not base:
            return None
        is_sure = last_name(base) in BASE_FRAMES or base == self._odometry_child
        return Placed(place, base, is_sure, tuple(findings))

    def between(self, target: str, source: str) -> NDArray[np.float64] | None:
        """``target_from_source`` (4, 4); None where the frames are not fixed to each other."""
        with self._lock:
            return self._links.fixed().between(target, source)

    def odometry(self, sensor_frame: str) -> OdometryLinks | None:
        """The links that are the odometry, once they were seen to move."""
        with self._lock:
            found = self._links.odometry(sensor_frame)
        return found if found is not None and found.moves else None

    def _published_base(self, sensor_frame: str) -> str:
        if self._base_frame != BASE_FRAMES[0]:
            return self._base_frame
        with self._lock:
            return SensorPlaces(self._links, self._odometry_child, None, []).base_frame(sensor_frame)

    def _on_given_base(self, sensor_frame: str) -> Placed | None:
        if sensor_frame == self._base_frame:
            place = SensorPlace.from_pose(IDENTITY, "base frame")
            return Placed(place, self._base_frame, is_sure=True)
        matrix = self.between(self._base_frame, sensor_frame)
        if matrix is None:
            return None
        return Placed(SensorPlace(matrix, "tf"), self._base_frame, is_sure=True)
