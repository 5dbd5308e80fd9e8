"""Segments of the path between two places that are known well, as odometry reported them."""

from dataclasses import dataclass
from math import copysign, hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_model_kernels import carry
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments_kernels import append_step
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import step_between

_SHORTEST = 1.0
"""Metres plus radians, so that what odometry gets wrong exceeds the centimetres by which estimates are
off."""
_LONGEST = 3.0
"""By judgement: metres plus radians, beyond which errors are no longer linear."""
_LITTLE = 1e-3
"""Change of a fault for which the end of the path is followed too, so that the difference quotient gives its
derivative: small, since the end is not quite linear in a fault, yet far above rounding."""


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
    distance: float
    """Metres along the path."""
    turn: float
    """Radians, to and fro."""
    pushed_distance: float
    """Metres, each by how hard the tyres were pushed along the car."""
    pushed_turn: float
    """Radians, each by how hard they were pushed across it."""

    @property
    def travel(self) -> float:
        """Metres plus radians."""
        return self.distance + self.turn


class OdometrySegments:
    """Divides the path into segments."""

    def __init__(self) -> None:
        self.start_anew()

    def start_anew(self) -> None:
        """The estimates to come do not continue those before."""
        self._begin: PoseEstimate | None = None
        self._ends = np.zeros((6, 3))
        """Where odometry leads from the beginning, without and with a little of each fault."""
        self._distance = self._turn = self._pushed_distance = self._pushed_turn = 0.0

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None) -> OdometrySegment | None:
        """The segment that a step ends; the estimate is of its end, None where the place is not known.

        Steps count as made by a car that is behind what its odometry says, by a ``lag`` as `slip_kernels` has
        it: odometry that comes early may still be right about how far.
        """
        if not isfinite(step.travel):
            self.start_anew()
            return None
        self._append(step, lag)
        travel = self._distance + self._turn
        if estimate is None or (self._begin is not None and travel < _SHORTEST):
            return None
        segment = None
        if self._begin is not None and travel <= _LONGEST:
            segment = self._ended_at(self._begin, estimate)
        self.start_anew()
        self._begin = estimate
        return segment

    def _append(self, step: MotionStep, lag: float) -> None:
        x, y, turn = step.base_from_next_base.tolist()
        along, across = step.effort.tolist()
        push = copysign(across, x * turn)
        append_step(self._ends, step.base_from_next_base + lag * step.behind, push, _LITTLE)
        distance, turn = hypot(x, y), abs(turn)
        self._distance += distance
        self._turn += turn
        self._pushed_distance += along * distance
        self._pushed_turn += across * turn

    def _ended_at(self, begin: PoseEstimate, end: PoseEstimate) -> OdometrySegment:
        by_odometry = self._ends[0]
        moved = [step_between(by_odometry, with_fault) for with_fault in self._ends[1:]]
        return OdometrySegment(
            error=step_between(by_odometry, step_between(begin.map_from_base, end.map_from_base)),
            by_faults=np.column_stack(moved) / _LITTLE,
            covariance=_covariance(begin, by_odometry, end),
            distance=self._distance,
            turn=self._turn,
            pushed_distance=self._pushed_distance,
            pushed_turn=self._pushed_turn,
        )


def _covariance(begin: PoseEstimate, by_odometry: Pose, end: PoseEstimate) -> NDArray[np.float64]:
    """(3, 3) of where the estimates say that the segment ended, seen from there."""
    carried, covariance = carry(begin.map_from_base, begin.covariance, by_odometry, np.zeros(3))
    cos, sin = np.cos(carried[2]), np.sin(carried[2])
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    seen: NDArray[np.float64] = turned.T @ (covariance + end.covariance) @ turned
    return seen
