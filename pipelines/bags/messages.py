"""Deserialization of ROS messages, and small parts of them."""

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from racecar.pipelines.bags.storage.chunks import BagTopic

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import (
        builtin_interfaces__msg__Time,
        geometry_msgs__msg__Quaternion,
    )

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO_SCAN = "sensor_msgs/msg/MultiEchoLaserScan"
POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
ODOMETRY = "nav_msgs/msg/Odometry"
IMU = "sensor_msgs/msg/Imu"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
OLD_TRANSFORMS = "tf/msg/tfMessage"
"""The same type in the first ``tf`` of ROS 1."""
TRANSFORM_TYPES = (TRANSFORMS, OLD_TRANSFORMS)
OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"
PATH = "nav_msgs/msg/Path"
ACKERMANN = "ackermann_msgs/msg/AckermannDriveStamped"
BOND = "bond/msg/Status"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
POSE_ARRAY = "geometry_msgs/msg/PoseArray"
PARTICLE_CLOUD = "nav2_msgs/msg/ParticleCloud"

_LARGEST_QUATERNION = 1e6
"""Limit of a quaternion's numbers, which should be at most 1; larger ones come from damaged bytes."""


@cache
def ros1_types() -> Typestore:
    """The ROS 1 message types, with those of ``/tf`` that the store of ``rosbags`` lacks."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in TRANSFORM_TYPES:
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    return store


@cache
def ros2_types() -> Typestore:
    """The ROS 2 message types; those used here are the same in every distribution. The old type of ``/tf`` is
    added for bags converted from ROS 1, and so are commands to cars that steer, nav2's particles and the
    heartbeats of bonds, which the store lacks."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", OLD_TRANSFORMS))
    numbers = ("steering_angle", "steering_angle_velocity", "speed", "acceleration", "jerk")
    drive = "ackermann_msgs/msg/AckermannDrive"
    store.register(get_types_from_msg("\n".join(f"float32 {number}" for number in numbers), drive))
    store.register(get_types_from_msg(f"std_msgs/Header header\n{drive} drive", ACKERMANN))
    particle = "nav2_msgs/msg/Particle"
    store.register(get_types_from_msg("geometry_msgs/Pose pose\nfloat64 weight", particle))
    store.register(get_types_from_msg(f"std_msgs/Header header\n{particle}[] particles", PARTICLE_CLOUD))
    status = "string id\nstring instance_id\nbool active\nfloat32 heartbeat_timeout\nfloat32 heartbeat_period"
    store.register(get_types_from_msg(f"std_msgs/Header header\n{status}", BOND))
    return store


def decode(topic: BagTopic, data: bytes) -> Any:
    """Deserialize a message; raises what ``rosbags`` raises if the bytes are damaged."""
    if topic.encoding == "ros1":
        return ros1_types().deserialize_ros1(data, topic.message_type)
    return ros2_types().deserialize_cdr(data, topic.message_type)


def type_name(message: Any) -> str:
    """Type of a ROS or ``rosbags`` message, such as ``sensor_msgs/msg/LaserScan``."""
    kind = type(message)
    name = getattr(kind, "__msgtype__", None) or f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
    return str(name)


def nanoseconds(stamp: "builtin_interfaces__msg__Time") -> int:
    """A time stamp in nanoseconds; zero, as of a driver that does not stamp, if its fields are not valid."""
    is_valid = stamp.sec >= 0 and stamp.nanosec < 1_000_000_000
    return stamp.sec * 1_000_000_000 + stamp.nanosec if is_valid else 0


def frame_name(name: str) -> str:
    """Strip the leading slash that frame names of ROS 1 may have."""
    return name.lstrip("/")


def rotation_matrix(quaternion: "geometry_msgs__msg__Quaternion") -> NDArray[np.float64] | None:
    """(3, 3); None if the quaternion is zero or not a number."""
    values = np.array([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    if not (np.abs(values) < _LARGEST_QUATERNION).all():
        return None
    norm = float(np.linalg.norm(values))
    if norm <= 1e-6:
        return None
    w, x, y, z = values / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
