"""Odometry that stands still while the scans move, as from a driver that sends a constant."""

import numpy as np

from racecar.mapping.self_calibration.config import StuckOdometryConfig
from racecar.mapping.self_calibration.wheel_track import MotionPairs


def is_stuck(motions: MotionPairs, config: StuckOdometryConfig) -> bool:
    """Whether the wheels neither travel nor turn in nearly all windows in which the scans do.

    A robot that is carried looks the same, unless a gyro is in its odometry.
    """
    moved = _moves(motions.by_scans, config.min_distance, config.min_turn)
    still = ~_moves(
        motions.by_wheels, config.max_share * config.min_distance, config.max_share * config.min_turn
    )
    windows = int(np.count_nonzero(moved))
    return windows >= config.min_windows and bool(still[moved].mean() >= config.min_stuck_share)


def _moves(motions: np.ndarray, distance: float, turn: float) -> np.ndarray:
    moves: np.ndarray = (np.hypot(motions[:, 0], motions[:, 1]) > distance) | (np.abs(motions[:, 2]) > turn)
    return moves
