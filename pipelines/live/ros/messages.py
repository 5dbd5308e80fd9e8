"""Poses, grids and clouds as ROS messages, and places set by clicks on a map."""

from array import array
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry as OdometryMessage
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.message_factory import MessageFactory
from racecar.pipelines.bags.messages import TRANSFORMS, ros2_types

_PLANAR = np.array([0, 1, 5])
"""Indices of x, y and yaw in a covariance over x, y, z, roll, pitch and yaw."""


def header(stamp: Any, frame: str) -> Any:
    """A message's header."""
    return Header(stamp=stamp, frame_id=frame)


def time_message(nanoseconds: int) -> Any:
    """A time stamp as a ROS message."""
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def quaternion_zw(yaw: float) -> tuple[float, float]:
    """z and w of the quaternion of a yaw angle."""
    return float(np.sin(yaw / 2)), float(np.cos(yaw / 2))


def fill_pose(message: Any, pose: Pose) -> None:
    """Set a geometry_msgs/Pose to a pose (3,)."""
    message.position.x, message.position.y = float(pose[0]), float(pose[1])
    message.orientation.z, message.orientation.w = quaternion_zw(float(pose[2]))


def odometry_message(
    stamp: Any, frame: str, child: str, pose: Pose, covariance: NDArray[np.float64], twist: Pose
) -> Any:
    """An Odometry message with a pose, its covariance (3, 3), and the base's twist (3,)."""
    message = OdometryMessage(header=header(stamp, frame), child_frame_id=child)
    fill_pose(message.pose.pose, pose)
    message.pose.covariance = _in_space(covariance)
    message.twist.twist.linear.x, message.twist.twist.linear.y = float(twist[0]), float(twist[1])
    message.twist.twist.angular.z = float(twist[2])
    return message


def pose_message(stamp: Any, frame: str, pose: Pose, covariance: NDArray[np.float64]) -> Any:
    """A PoseWithCovarianceStamped with a covariance (3, 3)."""
    message = PoseWithCovarianceStamped(header=header(stamp, frame))
    fill_pose(message.pose.pose, pose)
    message.pose.covariance = _in_space(covariance)
    return message


def start_pose(message: Any) -> tuple[Pose, NDArray[np.float64] | None]:
    """The pose (3,) of a PoseWithCovarianceStamped and its covariance (3, 3), None if invalid.

    Raises UserError when the pose is not valid.
    """
    pose = planar_pose(message)
    if pose is None:
        raise UserError("The initial pose is left out: its position or its quaternion is not valid.")
    covariance = np.asarray(message.pose.covariance, dtype=np.float64).reshape(6, 6)[np.ix_(_PLANAR, _PLANAR)]
    is_given = np.isfinite(covariance).all() and np.all(np.diag(covariance) > 0.0)
    return pose, covariance if is_given and np.linalg.eigvalsh(covariance).min() >= 0.0 else None


def grid_of(message: Any) -> OccupancyGrid:
    """The grid of a nav_msgs/OccupancyGrid. Raises UserError when its parts disagree."""
    info = message.info
    cells = np.array(message.data, dtype=np.int8)
    origin = info.origin
    yaw = np.arctan2(
        2 * (origin.orientation.w * origin.orientation.z + origin.orientation.x * origin.orientation.y),
        1 - 2 * (origin.orientation.y**2 + origin.orientation.z**2),
    )
    map_from_grid = np.array([origin.position.x, origin.position.y, yaw])
    if (
        cells.size != info.width * info.height
        or not 0.0 < info.resolution < np.inf
        or not np.isfinite(map_from_grid).all()
        or np.any((cells < -1) | (cells > 100))
    ):
        raise UserError(
            f"The map on the topic is left out: {info.width} × {info.height} cells of {info.resolution} m "
            f"with {cells.size} values do not make a map."
        )
    return OccupancyGrid(cells.reshape(info.height, info.width), float(info.resolution), map_from_grid)


def grid_message(stamp: Any, frame: str, grid: OccupancyGrid) -> Any:
    """A grid as nav_msgs/OccupancyGrid."""
    message = OccupancyGridMessage(header=header(stamp, frame))
    message.info.map_load_time = stamp
    message.info.resolution = float(grid.resolution)
    message.info.height, message.info.width = grid.cells.shape
    fill_pose(message.info.origin, grid.map_from_grid)
    message.data = array("b", np.ascontiguousarray(grid.cells).tobytes())
    return message


def cloud_message(stamp: Any, frame: str, points: NDArray[np.float64]) -> Any:
    """Points (N, 2) as PointCloud2, in the plane."""
    packed = np.zeros((len(points), 3), dtype="<f4")
    packed[:, :2] = points
    return PointCloud2(
        header=header(stamp, frame),
        height=1,
        width=len(points),
        fields=[
            PointField(name=axis, offset=4 * i, datatype=PointField.FLOAT32, count=1)
            for i, axis in enumerate("xyz")
        ],
        point_step=12,
        row_step=12 * len(points),
        data=array("B", packed.tobytes()),
        is_dense=True,
    )


def transform_bytes(nanoseconds: int, parent: str, child: str, parent_from_child: Pose) -> bytes:
    """A serialized tf2_msgs/TFMessage with one transform."""
    factory = MessageFactory(ros2_types(), is_ros1=False)
    message = factory.transform(nanoseconds, parent, child, parent_from_child)
    return bytes(ros2_types().serialize_cdr(message, TRANSFORMS))


def _in_space(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    full = np.zeros((6, 6))
    full[np.ix_(_PLANAR, _PLANAR)] = covariance
    return full.ravel()
