"""ROS 1 or ROS 2 messages from the project's own values."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.messages import (
    IMU,
    LASER_SCAN,
    OCCUPANCY_GRID,
    ODOMETRY,
    PATH,
    POSE_ARRAY,
    TRANSFORMS,
)

_PLANAR = [0, 1, 5]
"""x, y and yaw among the six coordinates of a covariance."""


class MessageFactory:
    """Fills in the message types of a type store."""

    def __init__(self, types: Typestore, *, is_ros1: bool) -> None:
        self._types = types
        self._is_ros1 = is_ros1

    def laser_scan(self, stamp_ns: int, frame_id: str, ranges: NDArray[np.float32], **fields: float) -> Any:
        """A sweep of N ranges in metres; ``fields`` are the others of LaserScan except ``angle_max``."""
        return self._new(
            LASER_SCAN,
            header=self._header(stamp_ns, frame_id),
            angle_max=fields["angle_min"] + fields["angle_increment"] * (len(ranges) - 1),
            ranges=np.asarray(ranges, dtype=np.float32),
            intensities=np.empty(0, dtype=np.float32),
            **fields,
        )

    def odometry(
        self,
        stamp_ns: int,
        frame_id: str,
        child_frame_id: str,
        pose: Pose,
        twist: Pose,
        covariance: NDArray[np.float64] | None,
    ) -> Any:
        """A pose (3,) and a twist (3,), with the covariance (3, 3) of the pose."""
        forward, sideways, turning = twist
        speeds = self._new(
            "geometry_msgs/msg/Twist",
            linear=self._vector(forward, sideways),
            angular=self._new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=float(turning)),
        )
        spread = np.zeros((6, 6))
        if covariance is not None:
            spread[np.ix_(_PLANAR, _PLANAR)] = covariance
        return self._new(
            ODOMETRY,
            header=self._header(stamp_ns, frame_id),
            child_frame_id=child_frame_id,
            pose=self._new(
                "geometry_msgs/msg/PoseWithCovariance", pose=self._pose(pose), covariance=spread.ravel()
            ),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=speeds, covariance=np.zeros(36)),
        )

    def imu(self, stamp_ns: int, frame_id: str, yaw_rate: float) -> Any:
        """A message with only the IMU's rate of turn about its z axis."""
        unknown = np.array([-1.0, *[0.0] * 8])
        return self._new(
            IMU,
            header=self._header(stamp_ns, frame_id),
            orientation=self._quaternion(0.0),
            orientation_covariance=unknown,
            angular_velocity=self._new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=float(yaw_rate)),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0),
            linear_acceleration_covariance=unknown,
        )

    def occupancy_grid(self, stamp_ns: int, frame_id: str, grid: OccupancyGrid) -> Any:
        """A map."""
        rows, columns = grid.cells.shape
        info = self._new(
            "nav_msgs/msg/MapMetaData",
            map_load_time=self._time(stamp_ns),
            resolution=float(grid.resolution),
            width=columns,
            height=rows,
            origin=self._pose(grid.map_from_grid),
        )
        header = self._header(stamp_ns, frame_id)
        return self._new(OCCUPANCY_GRID, header=header, info=info, data=grid.cells.ravel())

    def pose_array(self, stamp_ns: int, frame_id: str, poses: Pose) -> Any:
        """Poses (N, 3)."""
        listed = [self._pose(pose) for pose in poses]
        return self._new(POSE_ARRAY, header=self._header(stamp_ns, frame_id), poses=listed)

    def path(self, frame_id: str, stamps: Sequence[int], poses: Pose) -> Any:
        """Poses (N, 3) at stamps (N,), N at least 1."""
        listed = [
            self._new(
                "geometry_msgs/msg/PoseStamped", header=self._header(stamp, frame_id), pose=self._pose(pose)
            )
            for stamp, pose in zip(stamps, poses, strict=True)
        ]
        return self._new(PATH, header=self._header(stamps[-1], frame_id), poses=listed)

    def transform(self, stamp_ns: int, frame_id: str, child_frame_id: str, pose: Pose) -> Any:
        """A TFMessage of one transform: ``frame_from_child`` (3,)."""
        x, y, yaw = pose
        transform = self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp_ns, frame_id),
            child_frame_id=child_frame_id,
            transform=self._new(
                "geometry_msgs/msg/Transform", translation=self._vector(x, y), rotation=self._quaternion(yaw)
            ),
        )
        return self._new(TRANSFORMS, transforms=[transform])

    def _pose(self, pose: Pose) -> Any:
        x, y, yaw = pose
        position = self._new("geometry_msgs/msg/Point", x=float(x), y=float(y), z=0.0)
        return self._new("geometry_msgs/msg/Pose", position=position, orientation=self._quaternion(yaw))

    def _header(self, stamp_ns: int, frame_id: str) -> Any:
        sequence = {"seq": 0} if self._is_ros1 else {}
        return self._new("std_msgs/msg/Header", stamp=self._time(stamp_ns), frame_id=frame_id, **sequence)

    def _time(self, stamp_ns: int) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
        return self._new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _vector(self, x: float, y: float) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=0.0)

    def _quaternion(self, yaw: float) -> Any:
        half = yaw / 2
        return self._new(
            "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half))
        )

    def _new(self, message_type: str, **fields: Any) -> Any:
        return self._types.types[message_type](**fields)
