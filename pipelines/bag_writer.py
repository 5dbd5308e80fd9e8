"""Bags written by the simulator: they appear whole or not at all."""

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

from maps.errors import UserError
from maps.odometry import Odometry
from maps.se2 import Pose
from maps.whole_files import write_atomically
from pipelines.bag_messages import LASER_SCAN, ODOMETRY, TRANSFORMS, ros1_types, ros2_types
from pipelines.outputs import output_folder

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
    """A ROS 1 bag (``*.bag``) or else a ROS 2 bag folder with an mcap file in it; a context manager.

    Everything is written beside its place and renamed when the block ends without an error. Raises
    UserError when the place cannot be written to.
    """

    def __init__(self, path: Path) -> None:
        if path.suffix in (".mcap", ".db3"):
            raise UserError(f"{path} cannot be written as a lone file: name a .bag file, or a folder.")
        self._path = path
        self._is_ros1 = path.suffix == ".bag"
        self._types = ros1_types() if self._is_ros1 else ros2_types()
        self._connections: dict[str, Connection] = {}
        self._static_transforms: list[Pose] = []
        self._stack = ExitStack()

    def __enter__(self) -> "BagWriter":
        with ExitStack() as stack:
            if self._is_ros1:
                place = stack.enter_context(write_atomically(self._path))
                place.unlink()
                self._writer: Ros1Writer | Ros2Writer = stack.enter_context(Ros1Writer(place))
            else:
                place = stack.enter_context(output_folder(self._path)) / self._path.absolute().name
                stack.callback(_move_up, place)
                writer = Ros2Writer(place, version=8, storage_plugin=StoragePlugin.MCAP)
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
        """A sweep of N ranges in metres; angles in radians, times in seconds, as in LaserScan."""
        message = self._new(
            LASER_SCAN,
            header=self._header(stamp_ns, frame_id),
            angle_min=angle_min,
            angle_max=angle_min + angle_increment * (len(ranges) - 1),
            angle_increment=angle_increment,
            time_increment=time_increment,
            scan_time=scan_time,
            range_min=range_min,
            range_max=range_max,
            ranges=np.asarray(ranges, dtype=np.float32),
            intensities=np.empty(0, dtype=np.float32),
        )
        self.write_message(topic, LASER_SCAN, message, stamp_ns)

    def write_odometry(
        self,
        odometry: Odometry,
        topic: str = "/odom",
        frame_id: str = "odom",
        child_frame_id: str = "base_link",
    ) -> None:
        """A sample of odometry, or of any other pose over time."""
        forward, sideways, turning = odometry.twist
        no_covariance = np.zeros(36)
        twist = self._new(
            "geometry_msgs/msg/Twist",
            linear=self._vector(forward, sideways),
            angular=self._new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=float(turning)),
        )
        x, y, yaw = odometry.odom_from_base
        pose = self._new(
            "geometry_msgs/msg/Pose",
            position=self._new("geometry_msgs/msg/Point", x=float(x), y=float(y), z=0.0),
            orientation=self._quaternion(yaw),
        )
        message = self._new(
            ODOMETRY,
            header=self._header(odometry.stamp, frame_id),
            child_frame_id=child_frame_id,
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=no_covariance),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=no_covariance),
        )
        self.write_message(topic, ODOMETRY, message, odometry.stamp)

    def write_static_transform(self, base_from_laser: Pose) -> None:
        """The laser's place on the car; it bears the stamp of the message written next."""
        self._static_transforms.append(base_from_laser)

    def write_message(self, topic: str, message_type: str, message: Any, stamp_ns: int) -> None:
        """Any message of the writer's ``types``, recorded at ``stamp_ns``."""
        self._write_static_transforms(stamp_ns)
        if topic not in self._connections:
            self._connections[topic] = self._connect(topic, message_type)
        serialize = self._types.serialize_ros1 if self._is_ros1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic], stamp_ns, serialize(message, message_type))

    def _connect(self, topic: str, message_type: str) -> Connection:
        is_latched = topic == "/tf_static"
        if isinstance(self._writer, Ros1Writer):
            return self._writer.add_connection(
                topic, message_type, typestore=self._types, latching=int(is_latched)
            )
        qos = [_LATCHED] if is_latched else []
        return self._writer.add_connection(
            topic, message_type, typestore=self._types, offered_qos_profiles=qos
        )

    def _write_static_transforms(self, stamp_ns: int) -> None:
        waiting, self._static_transforms = self._static_transforms, []
        for x, y, yaw in waiting:
            transform = self._new(
                "geometry_msgs/msg/TransformStamped",
                header=self._header(stamp_ns, "base_link"),
                child_frame_id="laser",
                transform=self._new(
                    "geometry_msgs/msg/Transform",
                    translation=self._vector(x, y),
                    rotation=self._quaternion(yaw),
                ),
            )
            self.write_message(
                "/tf_static", TRANSFORMS, self._new(TRANSFORMS, transforms=[transform]), stamp_ns
            )

    def _header(self, stamp_ns: int, frame_id: str) -> Any:
        stamp = self._new(
            "builtin_interfaces/msg/Time", sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000
        )
        sequence = {"seq": 0} if self._is_ros1 else {}
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id, **sequence)

    def _vector(self, x: float, y: float) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=0.0)

    def _quaternion(self, yaw: float) -> Any:
        half = yaw / 2
        return self._new(
            "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half))
        )

    def _new(self, message_type: str, **fields: Any) -> Any:
        return self._types.types[message_type](**fields)


def _move_up(folder: Path) -> None:
    """``rosbags`` wants to make the folder itself; its files belong one folder higher."""
    for file in folder.iterdir():
        file.rename(folder.parent / file.name)
    folder.rmdir()
