"""Odometry that the scans contradict from end to end: it is not to be believed, or not in its turns."""

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
"""Metres that the scans must move, or radians that they must turn, in a window that counts; by judgement: ten
times the noise of a track."""
_STILL = 0.02
"""Share of these that the wheels may move in such a window and be still; by judgement: noise of an
encoder."""
_STILL_OF_DISTANCE = 0.05
"""Share of what the scans travel that the wheels may report and go nowhere; by judgement: drift to the
side."""
_MIN_SHARE = 0.95
"""Of these windows in which the wheels must be still; by judgement: the track may be lost in some."""
_MIN_JUMPS = 5
"""Steps faster than any robot below which odometry is possible; by judgement: drivers start anew."""
_MAX_JUMP_SHARE = 0.005
"""Share of the steps that may be so; by judgement: a yaw in degrees jumps wherever it wraps, and where the
robot turns."""


class OdometryFault(Enum):
    """What is wrong with it, for people."""

    STUCK = "is stuck, standing still while the scans move"
    """As from a driver that sends a constant. A robot that is carried looks the same, unless a gyroscope is
    in its odometry."""
    WITHOUT_DISTANCE = "turns but goes nowhere while the scans do"
    """As of a driver that integrates a gyroscope alone, or of a robot that is carried."""
    WITHOUT_TURNS = "never turns while the scans do"
    """As integrated from the speed alone."""
    IMPOSSIBLE = "moves or turns faster than any robot"
    """As in millimetres or degrees."""


def odometry_fault(samples: Sequence[Odometry], motions: MotionPairs) -> OdometryFault | None:
    """What is wrong with samples that were taken in those motions, if anything is."""
    return OdometryFault.IMPOSSIBLE if _is_impossible(samples) else _fault_in(motions)


def _is_impossible(samples: Sequence[Odometry]) -> bool:
    """Whether so many steps between samples are jumps that no restart of a driver explains them."""
    jumps = sum(
        is_jump(before.odom_from_base, after.odom_from_base, (after.stamp - before.stamp) * 1e-9)
        for before, after in pairwise(samples)
    )
    return jumps >= _MIN_JUMPS and jumps > _MAX_JUMP_SHARE * len(samples)


def _fault_in(motions: MotionPairs) -> OdometryFault | None:
    """Whether the wheels are still, or do not turn, in nearly all windows in which the scans do."""
    travelled, wheels_travelled = (np.hypot(*each[:, :2].T) for each in (motions.by_scans, motions.by_wheels))
    turned, wheels_turned = (np.abs(each[:, 2]) for each in (motions.by_scans, motions.by_wheels))
    stand, stay = wheels_travelled <= _STILL * _MIN_DISTANCE, wheels_turned <= _STILL * _MIN_TURN
    travels, turns = travelled > _MIN_DISTANCE, turned > _MIN_TURN

    def are_nearly_all(still: NDArray[np.bool_], moving: NDArray[np.bool_]) -> bool:
        is_enough = len(np.unique(motions.blocks[moving])) >= MIN_BLOCKS
        return is_enough and bool(np.mean(still[moving]) >= _MIN_SHARE)

    if are_nearly_all(stand & stay, travels | turns):
        return OdometryFault.STUCK
    # Wherever the laser sits, it does not come so far by turning.
    goes_far = travelled > _MIN_DISTANCE + FARTHEST_LASER * turned
    if are_nearly_all(wheels_travelled < _STILL_OF_DISTANCE * travelled, goes_far):
        return OdometryFault.WITHOUT_DISTANCE
    return OdometryFault.WITHOUT_TURNS if are_nearly_all(stay, turns) else None
