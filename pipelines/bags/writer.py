"""Writing bags, which appear complete or not at all."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.whole_files import write_atomically
from racecar.pipelines.bags.message_factory import MessageFactory
from racecar.pipelines.bags.messages import (
    IMU,
    LASER_SCAN,
    OCCUPANCY_GRID,
    ODOMETRY,
    PATH,
    POSE_ARRAY,
    TRANSFORMS,
    ros1_types,
    ros2_types,
)
from racecar.pipelines.bags.storage.recordings import CALLER, WRITTEN_BY, refuse_lone_part
from racecar.pipelines.files.outputs import whole_folder
from racecar.sensors.odometry import Odometry
from racecar.sensors.yaw_rate import YawRate

_LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    QosTime(0, 0),
    QosTime(0, 0),
    QosLiveliness.AUTOMATIC,
    QosTime(0, 0),
    False,
)


class BagWriter:
    """A ROS 1 bag (``*.bag``) or else a ROS 2 bag folder with an mcap file; a context manager.

    Everything is written to a temporary path and renamed when the block ends without an error. Raises
    UserError when the path cannot be written to.
    """

    def __init__(self, path: str | Path) -> None:
        path = Path(path)
        refuse_lone_part(path)
        self._path = path
        self._is_ros1 = path.suffix == ".bag"
        self._types = ros1_types() if self._is_ros1 else ros2_types()
        self._messages = MessageFactory(self._types, is_ros1=self._is_ros1)
        self._connections: dict[str, Connection] = {}
        self._static_transforms: list[Pose] = []
        self._stack = ExitStack()

    def __enter__(self) -> "BagWriter":
        with ExitStack() as stack:
            if self._is_ros1:
                place = stack.enter_context(write_atomically(self._path))
                self._writer: Ros1Writer | Ros2Writer = stack.enter_context(Ros1Writer(place))
            else:
                place = stack.enter_context(whole_folder(self._path)) / self._path.absolute().name
                stack.callback(_move_up, place)
                writer = Ros2Writer(place, version=8, storage_plugin=StoragePlugin.MCAP)
                for key, value in WRITTEN_BY.items():
                    writer.set_custom_data(key, value)
                self._writer = stack.enter_context(writer)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if error is None:
                self._write_static_transforms(0)
        finally:
            self._stack.__exit__(kind, error, traceback)

    def write_scan(
        self,
        stamp_ns: int,
        ranges: NDArray[np.float32],
        angle_min: float,
        angle_increment: float,
        time_increment: float,
        scan_time: float,
        range_min: float,
        range_max: float,
        topic: str = "/scan",
        frame_id: str = "laser",
    ) -> None:
        """Write a sweep of N ranges in metres; angles in radians, times in seconds, as in LaserScan."""
        message = self._messages.laser_scan(
            stamp_ns,
            frame_id,
            ranges,
            angle_min=angle_min,
            angle_increment=angle_increment,
            time_increment=time_increment,
            scan_time=scan_time,
            range_min=range_min,
            range_max=range_max,
        )
        self.write_message(topic, LASER_SCAN, message, stamp_ns)

    def write_odometry(
        self,
        odometry: Odometry,
        topic: str = "/odom",
        frame_id: str = "odom",
        child_frame_id: str = "base_link",
        covariance: NDArray[np.float64] | None = None,
    ) -> None:
        """Write a sample of odometry, or of any stamped pose, with the covariance (3, 3) of x, y and yaw."""
        message = self._messages.odometry(
            odometry.stamp, frame_id, child_frame_id, odometry.odom_from_base, odometry.twist, covariance
        )
        self.write_message(topic, ODOMETRY, message, odometry.stamp)

    def write_yaw_rate(self, yaw_rate: YawRate, topic: str = "/imu", frame_id: str = "base_link") -> None:
        """Write a gyroscope sample."""
        message = self._messages.imu(yaw_rate.stamp, frame_id, yaw_rate.rate)
        self.write_message(topic, IMU, message, yaw_rate.stamp)

    def write_transform(self, stamp_ns: int, frame_id: str, child_frame_id: str, pose: Pose) -> None:
        """Write the pose of a frame in another, ``frame_from_child`` (3,), on ``/tf``."""
        message = self._messages.transform(stamp_ns, frame_id, child_frame_id, pose)
        self.write_message("/tf", TRANSFORMS, message, stamp_ns)

    def write_map(
        self, stamp_ns: int, grid: OccupancyGrid, topic: str = "/map", frame_id: str = "map"
    ) -> None:
        """Write an occupancy grid; late subscribers receive it too."""
        message = self._messages.occupancy_grid(stamp_ns, frame_id, grid)
        self.write_message(topic, OCCUPANCY_GRID, message, stamp_ns)

    def write_poses(self, stamp_ns: int, poses: Pose, topic: str, frame_id: str = "map") -> None:
        """Write a set of poses (N, 3), such as particles."""
        message = self._messages.pose_array(stamp_ns, frame_id, poses)
        self.write_message(topic, POSE_ARRAY, message, stamp_ns)

    def write_path(self, stamps: Sequence[int], poses: Pose, topic: str, frame_id: str = "map") -> None:
        """Write poses (N, 3) over time, N at least 1; recorded at the last stamp."""
        message = self._messages.path(frame_id, stamps, poses)
        self.write_message(topic, PATH, message, stamps[-1])

    def write_static_transform(self, base_from_laser: Pose) -> None:
        """Write the laser's place on the car; it gets the stamp of the next message written."""
        self._static_transforms.append(base_from_laser)

    def write_message(self, topic: str, message_type: str, message: Any, stamp_ns: int) -> None:
        """Write any message of the writer's ROS version, recorded at ``stamp_ns``."""
        self._write_static_transforms(stamp_ns)
        if topic not in self._connections:
            self._connections[topic] = self._connect(topic, message_type)
        serialize = self._types.serialize_ros1 if self._is_ros1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic], stamp_ns, serialize(message, message_type))

    def _connect(self, topic: str, message_type: str) -> Connection:
        is_latched = topic == "/tf_static" or message_type == OCCUPANCY_GRID
        if isinstance(self._writer, Ros1Writer):
            return self._writer.add_connection(
                topic, message_type, typestore=self._types, callerid=CALLER, latching=int(is_latched)
            )
        qos = [_LATCHED] if is_latched else []
        return self._writer.add_connection(
            topic, message_type, typestore=self._types, offered_qos_profiles=qos
        )

    def _write_static_transforms(self, stamp_ns: int) -> None:
        waiting, self._static_transforms = self._static_transforms, []
        for pose in waiting:
            message = self._messages.transform(stamp_ns, "base_link", "laser", pose)
            self.write_message("/tf_static", TRANSFORMS, message, stamp_ns)


def _move_up(folder: Path) -> None:
    """``rosbags`` insists on creating the folder itself; its files belong one level higher."""
    for file in folder.iterdir():
        file.rename(folder.parent / file.name)
    folder.rmdir()
