"""Votes of one scan on the returns of another, and which scans are asked."""

import numpy as np

from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.fixed_returns.vote_kernels import APART, FIXED, LIMITS, UNDECIDED, WORLD, partners, votes
from tests.sensors.worlds import BEARINGS, CORRIDOR, box, ranges

ROOM = box(-3.0, -2.0, 4.0, 2.5)
BEFORE, NOW = np.zeros(3), np.array([0.6, 0.0, 0.0])


def vote(seen_now: np.ndarray, seen_before: np.ndarray, moved: Pose = NOW) -> np.ndarray:
    return votes(seen_now, BEARINGS, seen_before, BEARINGS, between(BEFORE, moved), LIMITS)


def share(found: np.ndarray, what: int, least: float, most: float) -> float:
    """Of the votes at bearings (degrees) between these."""
    is_there = (np.degrees(BEARINGS) >= least) & (np.degrees(BEARINGS) <= most)
    return float(np.mean(found[is_there] == what))


def test_walls_that_come_nearer_are_of_the_world() -> None:
    found = vote(ranges(ROOM, NOW), ranges(ROOM, BEFORE))
    assert share(found, WORLD, -25.0, 25.0) == 1.0
    assert not np.any(found == FIXED)


def test_walls_that_are_driven_along_leave_it_open() -> None:
    found = vote(ranges(CORRIDOR, NOW), ranges(CORRIDOR, BEFORE))
    assert share(found, UNDECIDED, -110.0, -20.0) == 1.0
    assert share(found, UNDECIDED, 20.0, 110.0) == 1.0


def test_what_stays_before_the_laser_moves_along() -> None:
    thing = np.where(np.abs(BEARINGS) < 0.5, 1.5, np.inf)
    found = vote(np.minimum(thing, ranges(ROOM, NOW)), np.minimum(thing, ranges(ROOM, BEFORE)))
    assert share(found, FIXED, -25.0, 25.0) > 0.9
    assert share(found, FIXED, 40.0, 135.0) == 0.0


def test_beams_that_come_back_empty_leave_it_to_those_beside_them() -> None:
    thing = np.where(np.abs(BEARINGS) < 0.5, 1.5, np.inf)
    before = np.minimum(thing, ranges(ROOM, BEFORE))
    before[::2] = np.inf
    found = vote(np.minimum(thing, ranges(ROOM, NOW)), before)
    assert share(found, FIXED, -25.0, 25.0) > 0.9


def test_another_place_is_asked_before_another_heading() -> None:
    """As long as both look the same way, more or less."""
    poses = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.4], [0.6, 0.0, 0.6], [0.7, 0.0, 1.2], [0.8, 0.0, 1.9]])
    found = partners(poses, np.zeros(5, dtype=np.int64), np.arange(5.0), APART)
    assert found[0].tolist() == [-1, 2]
    assert found[4].tolist() == [3, -1]  # it has turned too far from the one at a distance


def test_nobody_is_asked_of_another_segment_or_another_time() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    found = partners(poses, np.array([0, 0, 1]), np.array([0.0, 10.0, 10.1]), APART)
    assert np.all(found == -1)
