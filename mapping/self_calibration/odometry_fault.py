"""Odometry that the scans contradict from end to end: it is not to be believed, or not in its turns."""

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.wheel_track import MotionPairs
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import Odometry, is_jump

_MIN_DISTANCE, _MIN_TURN = 0.1, 0.1
"""Metres that the scans must move, or radians that they must turn, in a window that counts; by judgement: ten
times the noise of a track."""
_FARTHEST_LASER = 1.0
"""Metres that a laser sits from the middle of the turns at most; by judgement: so far it travels for each
radian that a robot turns on the spot."""
_MAX_SHARE = 0.02
"""Of these that the wheels may move in such a window and be still; by judgement: noise of an encoder."""
_MAX_SHARE_OF_DISTANCE = 0.05
"""Of what the scans travel that the wheels may report and go nowhere; by judgement: drift to the side."""
_MIN_WINDOWS = 20
"""Windows that must have moved; by judgement: ten seconds."""
_MIN_STILL_SHARE = 0.95
"""Share of them in which the wheels must be still; by judgement: the track may be lost in some."""
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


def is_impossible(samples: Sequence[Odometry]) -> bool:
    """Whether so many steps between samples are jumps that no restart of a driver explains them."""
    jumps = sum(
        is_jump(before.odom_from_base, after.odom_from_base, (after.stamp - before.stamp) * 1e-9)
        for before, after in pairwise(samples)
    )
    return jumps >= _MIN_JUMPS and jumps > _MAX_JUMP_SHARE * len(samples)


def fault_in(motions: MotionPairs) -> OdometryFault | None:
    """Whether the wheels are still, or do not turn, in nearly all windows in which the scans do."""
    travels, turns = _moves(motions.by_scans, share=1.0)
    wheels_travel, wheels_turn = _moves(motions.by_wheels, share=_MAX_SHARE)

    def lacks(wheels_move: NDArray[np.bool_], scans_move: NDArray[np.bool_]) -> bool:
        windows = int(np.count_nonzero(scans_move))
        return windows >= _MIN_WINDOWS and bool(np.mean(~wheels_move[scans_move]) >= _MIN_STILL_SHARE)

    if lacks(wheels_travel | wheels_turn, travels | turns):
        return OdometryFault.STUCK
    if lacks(~_stays_behind(motions), _goes_far(motions.by_scans)):
        return OdometryFault.WITHOUT_DISTANCE
    return OdometryFault.WITHOUT_TURNS if lacks(wheels_turn, turns) else None


def _goes_far(by_scans: Pose) -> NDArray[np.bool_]:
    """(W,) whether the base travels wherever the laser sits on it, which moves by (W, 3)."""
    most_by_turning = _FARTHEST_LASER * np.abs(by_scans[:, 2])
    far: NDArray[np.bool_] = _distances(by_scans) > _MIN_DISTANCE + most_by_turning
    return far


def _stays_behind(motions: MotionPairs) -> NDArray[np.bool_]:
    """(W,) whether the wheels travel next to nothing of what the scans do."""
    behind: NDArray[np.bool_] = _distances(motions.by_wheels) < _MAX_SHARE_OF_DISTANCE * _distances(
        motions.by_scans
    )
    return behind


def _distances(motions: Pose) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = np.hypot(motions[:, 0], motions[:, 1])
    return distances


def _moves(motions: Pose, share: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(W,) whether motions (W, 3) travel, and whether they turn, by a share of what counts."""
    travels = _distances(motions) > share * _MIN_DISTANCE
    return travels, np.abs(motions[:, 2]) > share * _MIN_TURN
