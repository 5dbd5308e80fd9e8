"""Segments of the path between two places that are known well, as odometry reported them."""

from dataclasses import dataclass
from math import copysign, hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, adjoint, inverse
from racecar.maps.geometry.se2_kernels import composed, step_between

_SHORTEST = 1.0
"""Metres plus radians, so that what odometry gets wrong exceeds the centimetres by which estimates are
off."""
_LONGEST = 3.0
"""By judgement: metres plus radians, beyond which errors are no longer linear."""


@dataclass(frozen=True, eq=False)
class OdometrySegment:
    """What odometry and the estimates say of a segment."""

    error: Pose
    """(3,) from where odometry says that it ended to where the estimates say."""
    by_faults: NDArray[np.float64]
    """(3, 5) by what the end moves, for faults (columns) of distance, turn and trim, see `OdometryFaults`,
    for a laser turned to the left, and for tyres that slip to the left at full effort."""
    covariance: NDArray[np.float64]
    """(3, 3) of the error, along, across and in heading, by the estimates at both ends."""
    driven: NDArray[np.float64]
    """(2,) metres along the path, and radians to and fro."""
    pushed: NDArray[np.float64]
    """(2,) the same, each by how hard the tyres were pushed: along the car, and across it."""

    @property
    def travel(self) -> float:
        """Metres plus radians."""
        return float(self.driven.sum())


class OdometrySegments:
    """Divides the path into segments."""

    def __init__(self) -> None:
        self.start_anew()

    def start_anew(self) -> None:
        """The estimates to come do not continue those before."""
        self._begin: PoseEstimate | None = None
        self._by_odometry: Pose = np.zeros(3)
        """Where odometry leads from the beginning."""
        self._by_faults = np.zeros((3, 5))
        """The derivative of that, in its own axes, by what an `OdometrySegment` says."""
        self._driven, self._pushed = np.zeros(2), np.zeros(2)

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None) -> OdometrySegment | None:
        """The segment that a step ends; the estimate is of its end, None where the place is not known.

        Steps count as made by a car that is behind what its odometry says, by a ``lag`` as `slip` has
        it: odometry that comes early may still be right about how far.
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
        """Go on by a step (3,) on which tyres were pushed so hard (2,) along the car and across it."""
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
    """(3, 3) of an estimate, along the car, across it and in heading."""
    map_from_base = adjoint([0.0, 0.0, estimate.map_from_base[2]])
    covariance: NDArray[np.float64] = map_from_base.T @ estimate.covariance @ map_from_base
    return covariance
