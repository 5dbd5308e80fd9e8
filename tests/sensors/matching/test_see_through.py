"""What one scan looks through, the other cannot have seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import Pose, compose, transform_points
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan
from racecar.sensors.matching.see_through import SeeThrough, see_through
from tests.sensors.worlds import ROOM, box, points_at, store_of

places = st.tuples(st.floats(-1.5, 0.5), st.floats(-1.5, 1.5), st.floats(-np.pi, np.pi)).map(np.array)
ONE_PAIR = np.array([[0, 1]])


def judge(store: ScanStore, first: Pose, second: Pose) -> SeeThrough:
    return see_through(store, ONE_PAIR, first[None], second[None])


def store_at(every: int, *poses: Pose) -> ScanStore:
    """Scans of which only one beam in so many returned."""
    store = ScanStore(len(poses))
    for pose in poses:
        store.add(prepare_scan(points_at(ROOM, pose)[::every]))
    return store


@pytest.mark.parametrize("every", [1, 8])
@settings(max_examples=30)
@given(places, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.4, 0.4))
def test_two_scans_of_one_place_agree(every: int, first: Pose, x: float, y: float, yaw: float) -> None:
    """Also those of a laser of few beams, which knows what lies between them."""
    second = compose(first, [x, y, yaw])
    seen = judge(store_at(every, first, second), first, second)
    assert seen.agreement > 0.97
    assert seen.coverage > 0.5


@pytest.mark.parametrize("every", [1, 8])
@settings(max_examples=30)
@given(places, st.floats(1.0, 2.0), st.floats(-np.pi, np.pi))
def test_a_wrong_claim_is_refuted(every: int, first: Pose, distance: float, towards: float) -> None:
    claimed = compose(first, [distance * np.cos(towards), distance * np.sin(towards), 0.0])
    assert judge(store_at(every, first, first), first, claimed).agreement < 0.85


@settings(max_examples=30)
@given(places, places, places)
def test_neither_scan_comes_first_and_the_frame_does_not_matter(
    first: Pose, second: Pose, world: Pose
) -> None:
    store = store_of(ROOM, np.array([first, second]))
    seen = judge(store, first, second)
    assert see_through(store, ONE_PAIR[:, ::-1], second[None], first[None]) == seen
    moved = judge(store, compose(world, first), compose(world, second))
    tallies = np.array([(s.on_surface, s.looked_through, s.undecided) for s in (seen, moved)])
    assert np.abs(tallies[0] - tallies[1]).max() <= 2  # points that lie on an edge, to rounding
    points = sum(len(store.points_of(scan)) for scan in (0, 1))
    assert seen.on_surface + seen.looked_through + seen.undecided == points


def test_a_thing_that_came_or_went_is_looked_through() -> None:
    laser = np.array([-1.0, 0.0, 0.0])
    with_post = np.concatenate([ROOM, box(0.2, -0.3, 0.5, 0.3)])
    store = ScanStore(2)
    store.add(prepare_scan(points_at(ROOM, laser)))
    store.add(prepare_scan(points_at(with_post, laser)))
    on_post = np.abs(transform_points(laser, points_at(with_post, laser)) - [0.3, 0.0]).max(axis=1) < 0.31
    seen = judge(store, laser, laser)
    assert on_post.sum() > 20
    assert seen.looked_through == on_post.sum()
    # the wall behind the post, where the other scan sees none
    assert abs(seen.undecided - on_post.sum()) < 10


def test_scans_back_to_back_tell_nothing() -> None:
    wall = np.array([[[-3.0, 5.0], [3.0, 5.0]], [[-3.0, -5.0], [3.0, -5.0]]])
    poses = np.array([[0.0, 4.0, np.pi / 2], [0.0, -4.0, -np.pi / 2]])
    seen = judge(store_of(wall, poses), poses[0], poses[1])
    assert seen.on_surface == seen.looked_through == 0
    assert seen.agreement == seen.coverage == 0.0
