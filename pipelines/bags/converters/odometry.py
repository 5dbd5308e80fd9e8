"""Conversion of Odometry messages to samples, even if only their twist is set."""

import math
from collections import Counter
from collections.abc import Iterable
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.odometry import Odometry

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Pose, nav_msgs__msg__Odometry

_MOVING_SPEED = 0.05  # m/s or rad/s
_MOVING_MESSAGES = 20
_GARBAGE_MESSAGES = 3000
"""Messages without a valid pose, the first minute of most odometry, after which none is expected. Chosen by
judgement: filters settle sooner."""
_LONGEST_STEP = 1.0  # seconds; over a longer gap the speed is not extrapolated
_FARTHEST = 1e8
"""Metres from the origin. Odometry in UTM coordinates stays below 1e7."""
_FASTEST = 1e3
"""m/s or rad/s; larger values come from damaged bytes."""


def planar_pose(message: "nav_msgs__msg__Odometry") -> Pose | None:
    """``odom_from_base`` (3,); None if the message has no valid pose."""
    return pose_in_plane(message.pose.pose)


def pose_in_plane(pose: "geometry_msgs__msg__Pose") -> Pose | None:
    """x, y and yaw (3,) of a pose in space; None if it is not valid."""
    position, q = pose.position, pose.orientation
    square = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z
    is_near = abs(position.x) < _FARTHEST and abs(position.y) < _FARTHEST
    if not is_near or not 1e-12 < square < math.inf:
        return None
    yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), square - 2 * (q.y * q.y + q.z * q.z))
    return np.array([position.x, position.y, yaw])


def planar_twist(message: "nav_msgs__msg__Odometry") -> Pose:
    """Forward, lateral and angular speed (3,); zero if the message has no plausible ones."""
    twist = message.twist.twist
    speeds = np.array([twist.linear.x, twist.linear.y, twist.angular.z])
    return speeds if bool((np.abs(speeds) < _FASTEST).all()) else np.zeros(3)


class PoseSource(Enum):
    """What on a topic shows the motion."""

    POSE = "the poses"
    TWIST = "the speeds"
    STANDING = "neither changes"
    NOTHING = "there are no messages"


def pose_source(messages: Iterable["nav_msgs__msg__Odometry"]) -> PoseSource:
    """Whether the poses show the motion, or the twist while there is no valid pose or it does not change.
    Stops reading once that is clear."""
    first: Pose | None = None
    moving = read = 0
    for read, message in enumerate(messages, start=1):
        pose = planar_pose(message)
        if pose is not None and first is not None and not np.array_equal(pose, first):
            return PoseSource.POSE
        if pose is not None and first is None:
            first, moving = pose, 0
        moving += _moves(message)
        if moving >= _MOVING_MESSAGES and (first is not None or read >= _GARBAGE_MESSAGES):
            break
    if moving >= _MOVING_MESSAGES:
        return PoseSource.TWIST
    return PoseSource.STANDING if read else PoseSource.NOTHING


def shows_speeds(messages: Iterable["nav_msgs__msg__Odometry"]) -> bool:
    """Whether the twist of any message says that the car moves."""
    return any(_moves(message) for message in messages)


def _moves(message: "nav_msgs__msg__Odometry") -> bool:
    return bool(np.abs(planar_twist(message)).max() > _MOVING_SPEED)


class OdometryConverter:
    """Converts messages to samples and counts those it drops."""

    def __init__(self, integrate_twist: bool, counts: Counter[str]) -> None:
        self._integrate_twist = integrate_twist
        self._counts = counts
        self._integrated: Pose = np.zeros(3)
        self._last_stamp: int | None = None

    def convert(self, message: "nav_msgs__msg__Odometry", stamp: int) -> Odometry | None:
        """The sample; None if the message has no valid pose."""
        twist = planar_twist(message)
        pose = self._integrate(twist, stamp) if self._integrate_twist else planar_pose(message)
        if pose is None:
            self._counts["invalid_odometry"] += 1
            return None
        return Odometry(stamp, pose, twist)

    def _integrate(self, twist: Pose, stamp: int) -> Pose:
        """Integrate the twist along an arc of constant speed since the last message."""
        step = 0.0 if self._last_stamp is None else (stamp - self._last_stamp) * 1e-9
        if 0 < step <= _LONGEST_STEP:
            forward, sideways, turn = twist * step
            half = turn / 2
            chord = np.sinc(half / np.pi)
            cos, sin = np.cos(half) * chord, np.sin(half) * chord
            moved = [cos * forward - sin * sideways, sin * forward + cos * sideways, turn]
            self._integrated = compose(self._integrated, moved)
        if step >= 0:
            self._last_stamp = stamp
        return self._integrated
