"""Segments of the odometry path between two well-known poses."""

from dataclasses import dataclass
from math import copysign, hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, adjoint, inverse
from racecar.maps.geometry.se2_kernels import composed, step_between

_SHORTEST = 1.0
"""Metres plus radians, so that the odometry error exceeds the centimetres of error in the estimates."""
_LONGEST = 3.0
"""Metres plus radians above which errors are no longer linear. Chosen by judgement."""


@dataclass(frozen=True, eq=False)
class OdometrySegment:
    """A segment as measured by odometry and by the estimates."""

    error: Pose
    """(3,) from the end by odometry to the end by the estimates."""
    by_faults: NDArray[np.float64]
    """(3, 5) derivative of the end by the faults (columns) of distance, turn and trim, see `OdometryFaults`,
    a laser rotated to the left, and tyres slipping to the left at full effort."""
    covariance: NDArray[np.float64]
    """(3, 3) covariance of the error, along, across and in heading, from the estimates at both ends."""
    driven: NDArray[np.float64]
    """(2,) metres along the path, and absolute radians."""
    pushed: NDArray[np.float64]
    """(2,) the same, weighted by the effort of the tyres along and across the car."""

    @property
    def travel(self) -> float:
        """Metres plus radians."""
        return float(self.driven.sum())


class OdometrySegments:
    """Splits the path into segments."""

    def __init__(self) -> None:
        self.start_anew()

    def start_anew(self) -> None:
        """Restart: the next estimates do not continue the previous ones."""
        self._begin: PoseEstimate | None = None
        self._by_odometry: Pose = np.zeros(3)
        """The pose by odometry relative to the beginning."""
        self._by_faults = np.zeros((3, 5))
        """Its derivative in its own axes, as in `OdometrySegment`."""
        self._driven, self._pushed = np.zeros(2), np.zeros(2)

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None) -> OdometrySegment | None:
        """The segment that a step completes; the estimate is of its end, None if its pose is not well known.

        Steps are those of a car that lags behind its odometry by ``lag`` as in `slip`: odometry that is ahead
        in time may still report the right distance.
        """
        if not isfinite(step.travel):
            self.start_anew()
            return None
        self._append(step.base_from_next_base + lag * step.behind, step.effort)
        travel = self._driven[0] + self._driven[1]
        if estimate is None or (self._begin is not None and travel < _SHORTEST):
            return None
        segment = None
        if self._begin is not None and travel <= _LONGEST:
            segment = self._ended_at(self._begin, estimate)
        self.start_anew()
        self._begin = estimate
        return segment

    def _append(self, step: Pose, effort: NDArray[np.float64]) -> None:
        """Append a step (3,) with the tyres' effort (2,) along and across the car."""
        x, y, turn = step.tolist()
        aside, driven = copysign(effort[1], turn) * x, np.array([hypot(x, y), abs(turn)])
        self._by_odometry = composed(self._by_odometry, step)
        moved = np.array([[x, 0.0, 0.0, y, 0.0], [y, 0.0, 0.0, -x, aside], [0.0] * 5])
        self._by_faults = adjoint(inverse(step)) @ (self._by_faults + moved)
        self._by_faults[2] += [0.0, turn, x, 0.0, 0.0]
        self._driven += driven
        self._pushed += effort * driven

    def _ended_at(self, begin: PoseEstimate, end: PoseEstimate) -> OdometrySegment:
        from_begin = adjoint(inverse(self._by_odometry))
        moved = step_between(begin.map_from_base, end.map_from_base)
        return OdometrySegment(
            step_between(self._by_odometry, moved),
            self._by_faults,
            from_begin @ _covariance_in_base(begin) @ from_begin.T + _covariance_in_base(end),
            self._driven,
            self._pushed,
        )


def _covariance_in_base(estimate: PoseEstimate) -> NDArray[np.float64]:
    """(3, 3) covariance of an estimate along the car, across it and in heading."""
    map_from_base = adjoint([0.0, 0.0, estimate.map_from_base[2]])
    covariance: NDArray[np.float64] = map_from_base.T @ estimate.covariance @ map_from_base
    return covariance
