"""Detect odometry that the scans contradict throughout: it is unusable, or its turns are."""

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import wrap_angle
from racecar.sensors.odometry import Odometry, is_jump
from racecar.sensors.self_calibration.mount import FARTHEST_LASER
from racecar.sensors.self_calibration.robust_fit import MIN_BLOCKS
from racecar.sensors.self_calibration.wheel_track import MotionPairs

_MIN_DISTANCE, _MIN_TURN = 0.1, 0.1
"""Metres or radians that the scans must move in a window that counts. Chosen by judgement: ten times the
noise of a track."""
_STILL = 0.02
"""Share of these below which the wheels stand still. Chosen by judgement: encoder noise."""
_STILL_OF_DISTANCE = 0.05
"""Share of the scans' travel that the wheels may report and still go nowhere. Chosen by judgement: drift to
the side."""
_MIN_SHARE = 0.95
"""Share of such windows in which the wheels must stand. Chosen by judgement: a track may get lost."""
_MIN_JUMPS = 5
"""Number of impossibly fast steps below which odometry is accepted. Chosen by judgement: drivers restart."""
_MAX_JUMP_SHARE = 0.005
"""Accepted share of such steps. Chosen by judgement: a yaw in degrees jumps at every wrap and turn."""
_AWAY = 0.005
"""Metres plus radians from zero at which a car has left it. Chosen by judgement: encoders that flicker while
it stands move by less."""
_BACK_AT_ONCE = 3.0
"""Multiple of the steps before and after from which a step back to zero is no motion. Chosen by judgement:
no car brakes and accelerates again that fast."""
_FROM_ZERO = 2.0
"""Multiple of these within which a pose counts from zero, since the car drives on between reset and
message."""


class OdometryFault(Enum):
    """A fault of odometry, as worded for people."""

    STUCK = "is stuck, standing still while the scans move"
    """Typical of a driver that sends a constant. A carried robot looks the same, unless its odometry uses a
    gyroscope."""
    WITHOUT_DISTANCE = "turns but goes nowhere while the scans do"
    """Typical of a driver that integrates only a gyroscope, or of a carried robot."""
    WITHOUT_TURNS = "never turns while the scans do"
    """Typical of integrating only the speed."""
    RESETS = "is set back to zero again and again"
    """Typical of a timer that calls the driver's reset."""
    IMPOSSIBLE = "moves or turns faster than any robot"
    """Typical of millimetres or degrees."""


def odometry_fault(samples: Sequence[Odometry], motions: MotionPairs) -> OdometryFault | None:
    """The fault of odometry samples over these motions, if any."""
    if _resets(samples):
        return OdometryFault.RESETS
    return OdometryFault.IMPOSSIBLE if _is_impossible(samples) else _fault_in(motions)


def _resets(samples: Sequence[Odometry]) -> bool:
    """Whether poses are set to zero more often than restarts of a driver explain."""
    if len(samples) < _MIN_JUMPS:
        return False
    poses = np.array([sample.odom_from_base for sample in samples])
    steps, from_zero = _sizes(np.diff(poses, axis=0)), _sizes(poses)
    before, after, around = from_zero[1:-2], from_zero[2:-1], np.maximum(steps[:-2], steps[2:])
    is_back = (after == 0.0) | ((after < _FROM_ZERO * around) & (steps[1:-1] > _BACK_AT_ONCE * around))
    return int(np.count_nonzero((before > _AWAY) & is_back)) >= _MIN_JUMPS


def _sizes(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) metres plus radians of poses (N, 3)."""
    sizes: NDArray[np.float64] = np.hypot(poses[:, 0], poses[:, 1]) + np.abs(wrap_angle(poses[:, 2]))
    return sizes


def _is_impossible(samples: Sequence[Odometry]) -> bool:
    """Whether there are more jumps between samples than restarts of a driver explain."""
    jumps = sum(
        is_jump(before.odom_from_base, after.odom_from_base, (after.stamp - before.stamp) * 1e-9)
        for before, after in pairwise(samples)
    )
    return jumps >= _MIN_JUMPS and jumps > _MAX_JUMP_SHARE * len(samples)


def _fault_in(motions: MotionPairs) -> OdometryFault | None:
    """Whether the wheels stand still, or do not turn, in nearly all windows in which the scans do."""
    travelled, wheels_travelled = (np.hypot(*each[:, :2].T) for each in (motions.by_scans, motions.by_wheels))
    turned, wheels_turned = (np.abs(each[:, 2]) for each in (motions.by_scans, motions.by_wheels))
    stand, stay = wheels_travelled <= _STILL * _MIN_DISTANCE, wheels_turned <= _STILL * _MIN_TURN
    travels, turns = travelled > _MIN_DISTANCE, turned > _MIN_TURN

    def are_nearly_all(still: NDArray[np.bool_], moving: NDArray[np.bool_]) -> bool:
        is_enough = len(np.unique(motions.blocks[moving])) >= MIN_BLOCKS
        return is_enough and bool(np.mean(still[moving]) >= _MIN_SHARE)

    if are_nearly_all(stand & stay, travels | turns):
        return OdometryFault.STUCK
    # Turning alone cannot move the laser that far, wherever it is mounted.
    goes_far = travelled > _MIN_DISTANCE + FARTHEST_LASER * turned
    if are_nearly_all(wheels_travelled < _STILL_OF_DISTANCE * travelled, goes_far):
        return OdometryFault.WITHOUT_DISTANCE
    return OdometryFault.WITHOUT_TURNS if are_nearly_all(stay, turns) else None
