"""Drives whose measurements bend the map, and how far off it is."""

from dataclasses import replace

import numpy as np

from racecar.mapping.graph.constraint import ConstraintList
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, chained, compose
from tests.mapping.sessions import RING, chain, path, session

INFORMATION = np.diag([1e3, 1e3, 3e3])


def bent(true: Pose, turn: float = 0.0, scale: float = 1.0, walls: np.ndarray = RING) -> Session:
    """What a drive along ``true`` (K, 3) ends in if each step turns and goes too far."""
    steps = between(true[:-1], true[1:]) * np.array([scale, scale, 1.0]) + np.array([0.0, 0.0, turn])
    mapped = compose(true[0], chained(steps))
    right = session(walls, true, IDENTITY, IDENTITY)
    return replace(right, map_from_keyframe=mapped, constraints=ConstraintList(chain(mapped, INFORMATION)))


def two_laps(turn: float = 0.004) -> Session:
    """Twice round the block; one step a second."""
    return bent(path(0.0, 60.0), turn)


def error(corrected: Session, true: Pose) -> float:
    """Metres by which the path is off at most; it begins where it should."""
    return float(np.hypot(*(corrected.map_from_keyframe - true)[:, :2].T).max())
