"""Planar poses: elements of SE(2) as arrays ``[x, y, yaw]`` (metres, radians).

Every function works on one pose of shape (3,) and, by broadcasting, on many of shape (..., 3).
Names follow the frames: ``map_from_laser = compose(map_from_base, base_from_laser)``.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Pose = NDArray[np.float64]
"""One pose (3,) or many (..., 3)."""

IDENTITY: Pose = np.zeros(3)
IDENTITY.flags.writeable = False


def wrap_angle(angle: ArrayLike) -> NDArray[np.float64]:
    """Wrap angles to (-π, π]."""
    wrapped: NDArray[np.float64] = _wrapped(np.asarray(angle, dtype=np.float64))
    return wrapped


def compose(a_from_b: ArrayLike, b_from_c: ArrayLike) -> Pose:
    """``a_from_c``; shapes (..., 3) broadcast against each other."""
    return _broadcast(_composed, a_from_b, b_from_c)


def inverse(a_from_b: ArrayLike) -> Pose:
    """``b_from_a``."""
    return _broadcast(_inverted, a_from_b)


def between(world_from_a: ArrayLike, world_from_b: ArrayLike) -> Pose:
    """``a_from_b``: the pose of b seen from a."""
    return _broadcast(_between, world_from_a, world_from_b)


def adjoint(a_from_b: ArrayLike) -> NDArray[np.float64]:
    """Adjoint (..., 3, 3) of poses (..., 3): maps a twist from the tangent frame of b to that of a.

    Solà, Deray and Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, equation 159. The
    transpose maps the information matrix of a twist the other way, ``adjoint.T @ information @ adjoint``.
    """
    x, y, yaw = np.moveaxis(np.asarray(a_from_b, dtype=np.float64), -1, 0)
    matrix = np.zeros((*np.shape(yaw), 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = np.cos(yaw)
    matrix[..., 1, 0] = np.sin(yaw)
    matrix[..., 0, 1] = -np.sin(yaw)
    matrix[..., 0, 2], matrix[..., 1, 2] = y, -x
    matrix[..., 2, 2] = 1.0
    return matrix


def are_apart(pose: Pose, other: Pose, limits: tuple[float, float]) -> bool:
    """Whether two poses (3,) differ by more than ``limits`` in metres or radians."""
    x, y, turn = between(pose, other)
    return bool(np.hypot(x, y) > limits[0] or abs(turn) > limits[1])


def transform_points(a_from_b: ArrayLike, points_in_b: ArrayLike) -> NDArray[np.float64]:
    """Transform points (N, 2) from frame b to frame a by one pose (3,)."""
    x, y, yaw = np.asarray(a_from_b, dtype=np.float64)
    cos, sin = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[cos, -sin], [sin, cos]])
    points: NDArray[np.float64] = np.asarray(points_in_b, dtype=np.float64) @ rotation.T + np.array([x, y])
    return points


def interpolate(start: ArrayLike, end: ArrayLike, fraction: ArrayLike) -> Pose:
    """Interpolate at constant rate, yaw the short way round; fractions outside [0, 1] extrapolate."""
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    step = end - start
    step[..., 2] = wrap_angle(step[..., 2])
    pose: Pose = start + np.asarray(fraction, dtype=np.float64)[..., None] * step
    pose[..., 2] = wrap_angle(pose[..., 2])
    return pose


def chained(steps: ArrayLike) -> Pose:
    """Accumulate steps (N, 3) into poses (N + 1, 3), starting at the identity."""
    steps = np.asarray(steps, dtype=np.float64)
    yaw = np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    cos, sin = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    x = np.cumsum(cos * steps[:, 0] - sin * steps[:, 1])
    y = np.cumsum(sin * steps[:, 0] + cos * steps[:, 1])
    return np.column_stack([np.append(0.0, x), np.append(0.0, y), wrap_angle(yaw)])


def mean_angle(angles: ArrayLike, weights: NDArray[np.float64] | None = None) -> float:
    """Circular mean of angles (N,): the direction of the (weighted) mean unit vector."""
    angles = np.asarray(angles, dtype=np.float64)
    sin, cos = np.average(np.sin(angles), weights=weights), np.average(np.cos(angles), weights=weights)
    return float(np.arctan2(sin, cos))


def _composed(trigonometry: Any, left: Sequence[Any], right: Sequence[Any]) -> tuple[Any, Any, Any]:
    """x, y and yaw of the result, for numbers with ``math`` or for arrays with ``numpy``."""
    cos, sin = trigonometry.cos(left[2]), trigonometry.sin(left[2])
    x, y, yaw = right
    return left[0] + cos * x - sin * y, left[1] + sin * x + cos * y, _wrapped(left[2] + yaw)


def _inverted(trigonometry: Any, pose: Sequence[Any]) -> tuple[Any, Any, Any]:
    cos, sin = trigonometry.cos(pose[2]), trigonometry.sin(pose[2])
    x, y, yaw = pose
    return -cos * x - sin * y, sin * x - cos * y, _wrapped(-yaw)


def _between(trigonometry: Any, left: Sequence[Any], right: Sequence[Any]) -> tuple[Any, Any, Any]:
    return _composed(trigonometry, _inverted(trigonometry, left), right)


def _wrapped(angle: Any) -> Any:
    return math.pi - (math.pi - angle) % math.tau


def _broadcast(formula: Callable[..., tuple[Any, Any, Any]], *poses: ArrayLike) -> Pose:
    """Apply a formula to poses (..., 3). Single poses use plain floats: they are frequent, and NumPy takes
    four times as long for them."""
    arrays = [np.asarray(pose, dtype=np.float64) for pose in poses]
    if all(array.ndim == 1 for array in arrays):
        return np.array(formula(math, *(array.tolist() for array in arrays)))
    x, y, yaw = formula(np, *([array[..., 0], array[..., 1], array[..., 2]] for array in arrays))
    pose = np.empty(np.broadcast_shapes(*(array.shape for array in arrays)))
    pose[..., 0], pose[..., 1], pose[..., 2] = x, y, yaw
    return pose
