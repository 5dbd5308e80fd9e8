"""Only what earlier passes show, and loop closures tie to them, may be trimmed."""

import numpy as np
import pytest

from racecar.mapping.keyframes import known_places
from racecar.mapping.keyframes.known_places import matches_with_known
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from tests.sensors.worlds import box, store_of

RING = np.concatenate(
    [box(-8, -6, 8, 6), box(-4, -2, 4, 2), box(-1, 2, 0, 2.5), box(2, -6, 2.4, -5.4), box(7.5, 1, 8, 3)]
)
"""16 x 12 m about a block, with things along the walls."""
PER_LAP = 120
VARIANCES_PER_METRE = np.array([0.03**2, 0.002**2])
"""Square metres and radians that the path may err: some 0.2 m in a lap."""

HALL = np.concatenate([box(-10, -5, 10, 5), box(-7, -0.05, 0, 0.05)])
"""20 x 10 m, with a thin wall along part of its middle."""


def laps(count: int) -> Pose:
    """(PER_LAP * count, 3) round the block, 0.3 m apart, each lap up to a few decimetres beside another."""
    angles = np.arange(PER_LAP * count) * (2.0 * np.pi / PER_LAP)
    wide = 1.0 + 0.04 * np.sin(0.7 * angles)
    x, y = 6.2 * wide * np.cos(angles), 4.2 * wide * np.sin(angles)
    return np.column_stack([x, y, np.arctan2(np.gradient(y), np.gradient(x))])


def driven(walls: np.ndarray, poses: Pose) -> LoopCloser:
    """Loop closure over the keyframes of a drive, that has found nothing yet."""
    loops = LoopCloser(store_of(walls, poses))
    for distance in np.hypot(*np.diff(poses[:, :2], axis=0, prepend=poses[:1, :2]).T):
        loops.history.graph.add_keyframe(float(distance))
        loops.history.graph.add_variances(distance * VARIANCES_PER_METRE[None])
    return loops


def close_loops(loops: LoopCloser, poses: Pose, first_pass: int) -> None:
    """From every second submap after the first so many keyframes to the nearest before."""
    earlier = [submap for submap in loops.history.submaps if submap.middle < first_pass]
    middles = poses[[submap.middle for submap in earlier], :2]
    for moving in loops.history.submaps[len(earlier) :: 2]:
        nearest = int(np.argmin(np.hypot(*(middles - poses[moving.middle, :2]).T)))
        loops.history.accept([Hypothesis(earlier[nearest], moving, IDENTITY, np.eye(3), 1.0)])


@pytest.mark.parametrize("count", [2, 3])
def test_later_laps_are_known_by_the_first_one(count: int) -> None:
    poses = laps(count)
    loops = driven(RING, poses)
    close_loops(loops, poses, PER_LAP)
    ties = matches_with_known(np.arange(len(poses)), poses, loops)
    trimmed = np.array([tie.to_keyframe for tie in ties])
    assert abs(trimmed[0] - PER_LAP) < 10
    assert len(trimmed) > 0.9 * (len(poses) - PER_LAP)
    assert np.all(np.diff(trimmed) > 0)
    for tie in ties:
        assert tie.from_keyframe < PER_LAP + 10
        missed = between(between(poses[tie.from_keyframe], poses[tie.to_keyframe]), tie.from_pose_to_pose)
        assert np.hypot(missed[0], missed[1]) < 0.02
        assert abs(missed[2]) < 0.01


def test_a_lap_that_no_loop_ties_to_another_may_be_elsewhere() -> None:
    poses = laps(2)
    assert matches_with_known(np.arange(len(poses)), poses, driven(RING, poses)) == []


def test_who_comes_the_other_way_sees_something_else() -> None:
    there = laps(1)[: PER_LAP // 2]
    poses = np.concatenate([there, there[::-1] + np.array([0.0, 0.0, np.pi])])
    loops = driven(RING, poses)
    close_loops(loops, poses, len(there))
    assert matches_with_known(np.arange(len(poses)), poses, loops) == []


def test_what_was_trimmed_makes_nothing_known() -> None:
    poses = laps(3)
    loops = driven(RING, poses)
    close_loops(loops, poses, PER_LAP)
    loops.store.trim(np.arange(PER_LAP))
    ties = matches_with_known(np.arange(len(poses)), poses, loops)
    assert abs(ties[0].to_keyframe - 2 * PER_LAP) < 10


def test_who_is_near_but_behind_a_wall_sees_something_else(monkeypatch: pytest.MonkeyPatch) -> None:
    along = np.arange(-5.0, -0.95, 0.1)
    lane = np.column_stack([along, np.full_like(along, 0.5), np.zeros_like(along)])
    poses = np.concatenate([lane, lane * [1.0, -1.0, 1.0]])
    loops = driven(HALL, poses)
    close_loops(loops, poses, len(lane))
    assert matches_with_known(np.arange(len(poses)), poses, loops) == []
    monkeypatch.setattr(known_places, "_MIN_COVERAGE", 0.0)
    assert len(matches_with_known(np.arange(len(poses)), poses, loops)) > 0
