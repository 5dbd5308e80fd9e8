"""Detect odometry that the scans contradict throughout: it is unusable, or its turns are."""

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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


class OdometryFault(Enum):
    """A fault of odometry, as worded for people."""

    STUCK = "is stuck, standing still while the scans move"
    """Typical of a driver that sends a constant. A carried robot looks the same, unless its odometry uses a
    gyroscope."""
    WITHOUT_DISTANCE = "turns but goes nowhere while the scans do"
    """Typical of a driver that integrates only a gyroscope, or of a carried robot."""
    WITHOUT_TURNS = "never turns while the scans do"
    """Typical of integrating only the speed."""
    IMPOSSIBLE = "moves or turns faster than any robot"
    """Typical of millimetres or degrees."""


def odometry_fault(samples: Sequence[Odometry], motions: MotionPairs) -> OdometryFault | None:
    """The fault of odometry samples over these motions, if any."""
    return OdometryFault.IMPOSSIBLE if _is_impossible(samples) else _fault_in(motions)


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
