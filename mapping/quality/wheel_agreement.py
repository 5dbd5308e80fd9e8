"""Do the wheels, as they were corrected, and the finished map agree over a short distance?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import ConstraintList
from racecar.maps.geometry.se2 import Pose, between, compose


@dataclass(frozen=True, eq=False)
class WheelAgreement:
    """W windows of the path that the wheels measured from end to end."""

    keyframes: NDArray[np.int64]
    """(W, 2) the first and the last."""
    metres: NDArray[np.float64]
    """(W,) by which the last keyframe lies elsewhere than the wheels say, as seen from the first."""


def wheel_agreement(
    constraints: ConstraintList, poses: Pose, path: NDArray[np.float64], length: float
) -> WheelAgreement:
    """Over windows of ``length`` metres, by the path (K,) of keyframes at (K, 3) or by the wheels."""
    arrays = constraints.to_arrays()
    ends = arrays["keyframes"].astype(np.int64)
    of_wheels = np.flatnonzero(constraints.are("odometry") & (ends[:, 1] == ends[:, 0] + 1))
    steps = np.full((len(poses), 3), np.nan)
    steps[ends[of_wheels, 1]] = arrays["poses"][of_wheels]
    windows, moved = [], []
    start, by_wheels, driven = 0, np.zeros(3), 0.0
    for k in range(1, len(poses)):
        if np.isnan(steps[k, 0]):
            start, by_wheels, driven = k, np.zeros(3), 0.0
            continue
        by_wheels, driven = compose(by_wheels, steps[k]), driven + float(np.hypot(*steps[k, :2]))
        # The map may say that the car hardly moved, or the wheels may.
        if max(path[k] - path[start], driven) >= length:
            windows.append((start, k))
            moved.append(by_wheels)
            start, by_wheels, driven = k, np.zeros(3), 0.0
    keyframes = np.array(windows, dtype=np.int64).reshape(-1, 2)
    measured = np.array(moved).reshape(-1, 3)
    off = between(measured, between(poses[keyframes[:, 0]], poses[keyframes[:, 1]]))
    return WheelAgreement(keyframes, np.hypot(off[:, 0], off[:, 1]))
