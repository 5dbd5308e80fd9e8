"""The planar rigid motion that lays places on others."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points, wrap_angle


def rigid_alignment(
    places: NDArray[np.float64], others: NDArray[np.float64], yaw_of_one_place: float = 0.0
) -> Pose:
    """(3,) the least-squares motion of places (N, 2) to others (N, 2), by Kabsch's closed form in two
    dimensions, which is also defined for places on a line. For places that are all the same, the yaw is to be
    given."""
    a, b = places - places.mean(axis=0), others - others.mean(axis=0)
    dot, cross = float(np.sum(a * b)), float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))
    differ = np.hypot(dot, cross) > 1e-9 * len(places)
    yaw = float(np.arctan2(cross, dot)) if differ else yaw_of_one_place
    turned = transform_points(np.array([0.0, 0.0, yaw]), places.mean(axis=0)[None])[0]
    return np.array([*(others.mean(axis=0) - turned), float(wrap_angle(yaw))])
