"""Odometry that the scans contradict from end to end: it is not to be believed, or not in its turns."""

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.config import OdometryFaultConfig
from racecar.mapping.self_calibration.wheel_track import MotionPairs
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import Odometry, is_jump


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


def is_impossible(samples: Sequence[Odometry], config: OdometryFaultConfig) -> bool:
    """Whether so many steps between samples are jumps that no restart of a driver explains them."""
    jumps = sum(
        is_jump(before.odom_from_base, after.odom_from_base, (after.stamp - before.stamp) * 1e-9)
        for before, after in pairwise(samples)
    )
    return jumps >= config.min_jumps and jumps > config.max_jump_share * len(samples)


def fault_in(motions: MotionPairs, config: OdometryFaultConfig) -> OdometryFault | None:
    """Whether the wheels are still, or do not turn, in nearly all windows in which the scans do."""
    travels, turns = _moves(motions.by_scans, config, share=1.0)
    wheels_travel, wheels_turn = _moves(motions.by_wheels, config, share=config.max_share)

    def lacks(wheels_move: NDArray[np.bool_], scans_move: NDArray[np.bool_]) -> bool:
        windows = int(np.count_nonzero(scans_move))
        return windows >= config.min_windows and bool(
            np.mean(~wheels_move[scans_move]) >= config.min_still_share
        )

    if lacks(wheels_travel | wheels_turn, travels | turns):
        return OdometryFault.STUCK
    if lacks(~_stays_behind(motions, config), _goes_far(motions.by_scans, config)):
        return OdometryFault.WITHOUT_DISTANCE
    return OdometryFault.WITHOUT_TURNS if lacks(wheels_turn, turns) else None


def _goes_far(by_scans: Pose, config: OdometryFaultConfig) -> NDArray[np.bool_]:
    """(W,) whether the base travels wherever the laser sits on it, which moves by (W, 3)."""
    most_by_turning = config.farthest_laser * np.abs(by_scans[:, 2])
    far: NDArray[np.bool_] = _distances(by_scans) > config.min_distance + most_by_turning
    return far


def _stays_behind(motions: MotionPairs, config: OdometryFaultConfig) -> NDArray[np.bool_]:
    """(W,) whether the wheels travel next to nothing of what the scans do."""
    behind: NDArray[np.bool_] = _distances(motions.by_wheels) < config.max_share_of_distance * _distances(
        motions.by_scans
    )
    return behind


def _distances(motions: Pose) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = np.hypot(motions[:, 0], motions[:, 1])
    return distances


def _moves(
    motions: Pose, config: OdometryFaultConfig, share: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(W,) whether motions (W, 3) travel, and whether they turn, by a share of what counts."""
    travels = _distances(motions) > share * config.min_distance
    return travels, np.abs(motions[:, 2]) > share * config.min_turn
