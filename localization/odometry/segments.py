"""Stretches of the way between two places that are known well, as odometry told them."""

from dataclasses import dataclass
from math import hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments_kernels import go_on
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import step_between

_SHORTEST, _LONGEST = 1.0, 3.0
"""Metres plus radians."""
_LITTLE = 1e-3
"""Change of a fault for which the end of the way is told beside how it was, to learn what the fault does."""


@dataclass(frozen=True, eq=False)
class OdometryStretch:
    """What odometry and the estimates say of a stretch."""

    error: Pose
    """(3,) from where odometry says that it ended to where the estimates say."""
    by_faults: NDArray[np.float64]
    """(3, 3) by what the end moves, for faults (columns) of way, turn and trim, see
    `racecar.localization.odometry.calibration`."""
    begin_variances: NDArray[np.float64]
    """(2,) of the estimated place, along any direction, and heading."""
    end_variances: NDArray[np.float64]
    path: float
    turn: float
    pushed_path: float
    """Metres, each by how hard the tyres were pushed along the car."""
    pushed_turn: float
    """Radians, each by how hard they were pushed across it."""

    @property
    def way(self) -> float:
        """Metres plus radians."""
        return self.path + self.turn


class OdometryStretches:
    """Divides the way."""

    def __init__(self) -> None:
        self.start_anew()

    def start_anew(self) -> None:
        """The estimates to come do not continue those before."""
        self._begin: PoseEstimate | None = None
        self._told = np.zeros((4, 3))
        """Where odometry leads from the beginning, without and with a little of each fault."""
        self._path = self._turn = self._pushed_path = self._pushed_turn = 0.0

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None) -> OdometryStretch | None:
        """The stretch that a step ends; the estimate says where that led, None where the place is not known.

        Steps count as made by a car that is behind what its odometry says, by a ``lag`` as
        `racecar.localization.odometry.slip` has it: odometry that comes early may still tell rightly how far.
        """
        if not isfinite(step.travel):
            self.start_anew()
            return None
        self._go_on(step, lag)
        way = self._path + self._turn
        if estimate is None or (self._begin is not None and way < _SHORTEST):
            return None
        stretch = None
        if self._begin is not None and way <= _LONGEST:
            stretch = self._ended_at(self._begin, estimate)
        self.start_anew()
        self._begin = estimate
        return stretch

    def _go_on(self, step: MotionStep, lag: float) -> None:
        go_on(self._told, step.base_from_next_base + lag * step.behind, _LITTLE)
        x, y, turn = step.base_from_next_base.tolist()
        along, across = step.effort.tolist()
        path, turn = hypot(x, y), abs(turn)
        self._path += path
        self._turn += turn
        self._pushed_path += along * path
        self._pushed_turn += across * turn

    def _ended_at(self, begin: PoseEstimate, end: PoseEstimate) -> OdometryStretch:
        told = self._told[0]
        moved = [step_between(told, told_if) for told_if in self._told[1:]]
        return OdometryStretch(
            error=step_between(told, step_between(begin.map_from_base, end.map_from_base)),
            by_faults=np.column_stack(moved) / _LITTLE,
            begin_variances=_variances(begin),
            end_variances=_variances(end),
            path=self._path,
            turn=self._turn,
            pushed_path=self._pushed_path,
            pushed_turn=self._pushed_turn,
        )


def _variances(estimate: PoseEstimate) -> NDArray[np.float64]:
    xx, yy, heading = np.diag(estimate.covariance)
    return np.array([0.5 * (xx + yy), heading])
