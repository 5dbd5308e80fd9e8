"""Drives whose measurements bend the map, and how far off it is."""

from dataclasses import replace

import numpy as np

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.keyframes.constraints import pairs_along_path
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, chained, compose
from tests.mapping.sessions import RING, path, session

UNSURE_OF_TURNS, UNSURE_OF_LENGTHS = np.diag([1e4, 1e4, 3e3]), np.diag([1e3, 1e3, 1e5])
"""Information of one step. What bends a path grows with its length."""


def bent(true: Pose, turn: float = 0.0, scale: float = 1.0, walls: np.ndarray = RING) -> Session:
    """What a drive along ``true`` (K, 3) ends in if each step turns and goes too far."""
    steps = between(true[:-1], true[1:]) * np.array([scale, scale, 1.0]) + np.array([0.0, 0.0, turn])
    information = UNSURE_OF_TURNS if turn else UNSURE_OF_LENGTHS
    mapped = compose(true[0], chained(steps))
    right = session(walls, true, IDENTITY, IDENTITY)
    matches = [
        Constraint(
            first,
            second,
            between(mapped[first], mapped[second]),
            information / (second - first) ** 2,
            "scan_matching",
        )
        for first, second in pairs_along_path(range(len(true))).tolist()
    ]
    return replace(right, map_from_keyframe=mapped, constraints=ConstraintList(matches))


def two_laps(turn: float = 0.004) -> Session:
    """Twice round the block; one step a second."""
    return bent(path(0.0, 60.0), turn)


def error(corrected: Session, true: Pose) -> float:
    """Metres by which the path is off at most; it begins where it should."""
    return float(np.hypot(*(corrected.map_from_keyframe - true)[:, :2].T).max())
