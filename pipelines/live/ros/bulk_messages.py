"""Messages of thousands of poses, serialized at once: one by one they would block everything else."""

from typing import Any

import numpy as np
from geometry_msgs.msg import PoseArray
from nav_msgs.msg import Path
from numpy.typing import NDArray
from rclpy.serialization import serialize_message

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.ros.messages import header

_ENCAPSULATION = 4
"""Bytes before the message proper, which alignment does not count."""


def pose_array_bytes(stamp: Any, frame: str, poses: Pose) -> bytes:
    """A serialized geometry_msgs/PoseArray of poses (N, 3)."""
    return _array_bytes(stamp, frame, _in_space(poses))


def particle_cloud_bytes(stamp: Any, frame: str, poses: Pose, weights: NDArray[np.float64]) -> bytes:
    """A serialized nav2_msgs/ParticleCloud of poses (N, 3) and weights (N,)."""
    return _array_bytes(stamp, frame, np.column_stack([_in_space(poses), weights]))


def path_bytes(stamp: Any, frame: str, poses: Pose) -> bytes:
    """A serialized nav_msgs/Path of poses (N, 3), all with the path's stamp."""
    opening = _with_count(serialize_message(Path(header=header(stamp, frame))), len(poses))
    name = frame.encode() + b"\0"
    inner = np.array([stamp.sec, stamp.nanosec, len(name)], dtype="<u4").tobytes() + name
    parts = [opening]
    length = len(opening)
    for pose in _in_space(poses):
        head = bytes(-(length - _ENCAPSULATION) % 4) + inner
        head += _padding(length + len(head))
        parts += [head, pose.tobytes()]
        length += len(head) + pose.nbytes
    return b"".join(parts)


def _array_bytes(stamp: Any, frame: str, rows: NDArray[np.float64]) -> bytes:
    """A header, and a sequence of (N, K) numbers in K fields."""
    opening = _with_count(serialize_message(PoseArray(header=header(stamp, frame))), len(rows))
    return opening + _padding(len(opening)) + rows.tobytes()


def _with_count(serialized: bytes, count: int) -> bytes:
    """A message that ends in an empty sequence, with its length set to ``count``."""
    return serialized[:-4] + np.array(count, dtype="<u4").tobytes()


def _padding(length: int) -> bytes:
    """Padding up to the alignment of a double."""
    return bytes(-(length - _ENCAPSULATION) % 8)


def _in_space(poses: Pose) -> NDArray[np.float64]:
    """(N, 7) position and quaternion."""
    packed = np.zeros((len(poses), 7), dtype="<f8")
    packed[:, :2] = poses[:, :2]
    packed[:, 5], packed[:, 6] = np.sin(poses[:, 2] / 2), np.cos(poses[:, 2] / 2)
    return packed
