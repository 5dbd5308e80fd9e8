"""Planar poses: elements of SE(2) as arrays ``[x, y, yaw]`` (metres, radians).

Every function works on one pose of shape (3,) and, by broadcasting, on many of shape (..., 3).
Names follow the frames: ``map_from_laser = compose(map_from_base, base_from_laser)``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Pose = NDArray[np.float64]
"""One pose (3,) or many (..., 3)."""

IDENTITY: Pose = np.zeros(3)
IDENTITY.flags.writeable = False


def wrap_angle(angle: ArrayLike) -> NDArray[np.float64]:
    """The same angles in (-π, π]."""
    angle = np.asarray(angle, dtype=np.float64)
    return np.pi - np.mod(np.pi - angle, 2.0 * np.pi)


def compose(a_from_b: ArrayLike, b_from_c: ArrayLike) -> Pose:
    """``a_from_c``; shapes (..., 3) broadcast against each other."""
    left, right = np.asarray(a_from_b, dtype=np.float64), np.asarray(b_from_c, dtype=np.float64)
    cos, sin = np.cos(left[..., 2]), np.sin(left[..., 2])
    x, y = right[..., 0], right[..., 1]
    pose = np.empty(np.broadcast_shapes(left.shape, right.shape))  # filled in place: stacking takes longer
    pose[..., 0] = left[..., 0] + cos * x - sin * y
    pose[..., 1] = left[..., 1] + sin * x + cos * y
    pose[..., 2] = wrap_angle(left[..., 2] + right[..., 2])
    return pose


def inverse(a_from_b: ArrayLike) -> Pose:
    """``b_from_a``."""
    pose = np.asarray(a_from_b, dtype=np.float64)
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = pose[..., 0], pose[..., 1]
    inverted = np.empty(pose.shape)
    inverted[..., 0] = -cos * x - sin * y
    inverted[..., 1] = sin * x - cos * y
    inverted[..., 2] = wrap_angle(-pose[..., 2])
    return inverted


def between(world_from_a: ArrayLike, world_from_b: ArrayLike) -> Pose:
    """``a_from_b``: the pose of b seen from a."""
    return compose(inverse(world_from_a), world_from_b)


def are_apart(pose: Pose, other: Pose, limits: tuple[float, float]) -> bool:
    """Are two poses (3,) farther apart, or turned more, than ``limits`` in metres and radians?"""
    x, y, turn = between(pose, other)
    return bool(np.hypot(x, y) > limits[0] or abs(turn) > limits[1])


def transform_points(a_from_b: ArrayLike, points_in_b: ArrayLike) -> NDArray[np.float64]:
    """Points (N, 2) of frame b, given in frame a; the pose is one of shape (3,)."""
    x, y, yaw = np.asarray(a_from_b, dtype=np.float64)
    cos, sin = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[cos, -sin], [sin, cos]])
    points: NDArray[np.float64] = np.asarray(points_in_b, dtype=np.float64) @ rotation.T + np.array([x, y])
    return points


def interpolate(start: ArrayLike, end: ArrayLike, fraction: ArrayLike) -> Pose:
    """Between two poses at constant rate, yaw the short way round; a fraction may lie outside [0, 1]."""
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    step = end - start
    step[..., 2] = wrap_angle(step[..., 2])
    pose: Pose = start + np.asarray(fraction, dtype=np.float64)[..., None] * step
    pose[..., 2] = wrap_angle(pose[..., 2])
    return pose


def mean_angle(angles: ArrayLike, weights: NDArray[np.float64] | None = None) -> float:
    """Circular mean of angles (N,): the direction of the (weighted) mean unit vector."""
    angles = np.asarray(angles, dtype=np.float64)
    sin, cos = np.average(np.sin(angles), weights=weights), np.average(np.cos(angles), weights=weights)
    return float(np.arctan2(sin, cos))
