"""Do the wheels, as they were corrected, and the finished map agree over a short distance?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import ConstraintList
from racecar.maps.geometry.se2 import Pose, between, compose

_WINDOW = 2.0
"""Metres of path over which wheels and map are compared. By judgement: scans drift by millimetres and good
wheels by centimetres over it."""
MOST_DENIED = 1.0
"""Metres in such a window that the map may deny the wheels where no loop closure decides. Measured on 237
maps: no good one with wheels that were not turned round had more than 0.96; of 9 wrong ones that nothing else
told, 4 had more than 1.6."""


@dataclass(frozen=True, eq=False)
class WheelAgreement:
    """W windows of the path that the wheels measured from end to end."""

    keyframes: NDArray[np.int64]
    """(W, 2) the first and the last."""
    metres: NDArray[np.float64]
    """(W,) by which the last keyframe lies elsewhere than the wheels say, as seen from the first."""
    denied: NDArray[np.float64]
    """(W,) metres of the way by the wheels, step by step, that the map denies. A car that is lifted moves
    while its wheels claim nothing, and that denies none of it."""

    def unsettled(self, are_closed: NDArray[np.bool_]) -> float:
        """Metres that are denied at most in a window with steps that no loop closure spans, of those that
        ``are_closed`` (K - 1,) or not; 0 without any."""
        closed_before = np.concatenate([[0], np.cumsum(are_closed)])
        first, last = self.keyframes.T
        is_open = closed_before[last] - closed_before[first] < last - first
        return float(self.denied[is_open].max(initial=0.0))


def wheel_agreement(constraints: ConstraintList, poses: Pose, path: NDArray[np.float64]) -> WheelAgreement:
    """Window by window, by the path (K,) of keyframes at (K, 3) or by the wheels."""
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
        if max(path[k] - path[start], driven) >= _WINDOW:
            windows.append((start, k))
            moved.append(by_wheels)
            start, by_wheels, driven = k, np.zeros(3), 0.0
    keyframes = np.array(windows, dtype=np.int64).reshape(-1, 2)
    first, last = keyframes.T
    off = between(np.array(moved).reshape(-1, 3), between(poses[first], poses[last]))
    denied_until = np.cumsum(np.nan_to_num(_denied(steps, poses)))
    return WheelAgreement(keyframes, np.hypot(off[:, 0], off[:, 1]), denied_until[last] - denied_until[first])


def _denied(steps: Pose, poses: Pose) -> NDArray[np.float64]:
    """(K,) metres of the way by the wheels from the keyframe before, in steps (K, 3), that the map denies."""
    off = np.zeros((len(poses), 2))
    off[1:] = (between(poses[:-1], poses[1:]) - steps[1:])[:, :2]
    denied: NDArray[np.float64] = np.minimum(np.hypot(*off.T), np.hypot(*steps[:, :2].T))
    return denied
