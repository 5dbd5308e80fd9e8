"""Where the sensor sits on the car, from the transforms in a bag."""

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.messages import frame_name, rotation_matrix

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__TransformStamped


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """A sensor's place on the car in three dimensions, and what of it a planar scan needs."""

    base_from_sensor: NDArray[np.float64]
    """(4, 4)"""
    source: str
    """Where this is known from, for people."""

    @staticmethod
    def from_pose(base_from_sensor: Pose, source: str) -> "SensorPlace":
        """In the plane of the base."""
        x, y, yaw = base_from_sensor
        matrix = np.eye(4)
        matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        matrix[:2, 3] = x, y
        return SensorPlace(matrix, source)

    @property
    def pose(self) -> Pose:
        """(3,) ``base_from_laser``: position, and direction of the sensor's x axis, seen from above."""
        matrix = self.base_from_sensor
        return np.array([matrix[0, 3], matrix[1, 3], np.arctan2(matrix[1, 0], matrix[0, 0])])

    @property
    def is_upside_down(self) -> bool:
        """Whether the sensor counts its bearings clockwise, seen from above."""
        return bool(self.base_from_sensor[2, 2] < 0)

    @property
    def tilt(self) -> float:
        """Radians between the scan plane and the ground."""
        return float(np.arccos(np.clip(abs(self.base_from_sensor[2, 2]), 0.0, 1.0)))


class TransformTree:
    """Fixed transforms between frames."""

    def __init__(self) -> None:
        self._links: dict[str, dict[str, NDArray[np.float64]]] = {}

    def add(self, transform: "geometry_msgs__msg__TransformStamped") -> None:
        """Take a transform; one without a valid rotation is left out."""
        rotation = rotation_matrix(transform.transform.rotation)
        if rotation is None:
            return
        translation = transform.transform.translation
        parent_from_child = np.eye(4)
        parent_from_child[:3, :3] = rotation
        parent_from_child[:3, 3] = translation.x, translation.y, translation.z
        parent = frame_name(transform.header.frame_id)
        child = frame_name(transform.child_frame_id)
        self._links.setdefault(parent, {})[child] = parent_from_child
        self._links.setdefault(child, {})[parent] = np.linalg.inv(parent_from_child).astype(np.float64)

    def between(self, target: str, source: str) -> NDArray[np.float64] | None:
        """``target_from_source`` (4, 4) over any number of links; None where the frames are not linked."""
        found = {target: np.eye(4)}
        queue = deque([target])
        while queue:
            frame = queue.popleft()
            if frame == source:
                return found[frame]
            for neighbour, frame_from_neighbour in self._links.get(frame, {}).items():
                if neighbour not in found:
                    found[neighbour] = found[frame] @ frame_from_neighbour
                    queue.append(neighbour)
        return None
