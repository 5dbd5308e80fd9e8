"""What a map forgets when later drives have shown the same places."""

from dataclasses import replace
from functools import cache

import numpy as np

from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.rendering import Rays, render
from racecar.mapping.session.forgetting import forget_outdated
from racecar.mapping.session.merging import EarlierMap, merge
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.maps.grid.occupancy_grid import UNKNOWN
from tests.mapping.sessions import RING, path, session

ELSEWHERE = np.array([40.0, -25.0, 2.5])


def carried_on(earlier: Session, true: Pose) -> Session:
    """An earlier session and a drive along ``true`` (K, 3), which is found there."""
    return merge(EarlierMap(earlier), session(RING, true, ELSEWHERE, IDENTITY))


STARTS = (0.0, 7.0, 3.0, 20.0, 11.0, 30.0, 5.0, 16.0)


@cache
def rounds(count: int) -> tuple[Session, Pose]:
    """Drives from some places of the ring, each of which carries the map on; and where all that is left was
    taken."""
    drive = path(STARTS[count - 1], 34.0)
    if count == 1:
        return session(RING, drive, IDENTITY, IDENTITY), drive
    earlier, true = rounds(count - 1)
    joint = carried_on(earlier, drive)
    left = forget_outdated(joint)
    return left, np.concatenate([true, drive])[_left_of(joint, left)]


def _left_of(joint: Session, left: Session) -> np.ndarray:
    kept = {pose.tobytes() for pose in left.map_from_keyframe}
    return np.array([pose.tobytes() in kept for pose in joint.map_from_keyframe])


def test_a_map_grows_with_the_places_and_not_with_the_drives() -> None:
    few, _ = rounds(3)
    many, true = rounds(8)
    one = len(path(0.0, 34.0))
    assert len(few.rays) <= 3 * one
    assert len(many.rays) <= 3 * one
    assert len(many.constraints) < 1.5 * len(few.constraints)
    assert len(many.loops.submaps) <= len(few.loops.submaps) + 3
    assert np.abs(between(true, many.map_from_keyframe)).max() < 0.02
    Session.from_arrays(many.to_arrays())


def test_what_is_left_is_as_sure_and_where_it_was() -> None:
    map_, true = rounds(5)
    graph = PoseGraph(map_.constraints)
    solved = graph.optimize(map_.map_from_keyframe)
    assert np.abs(between(map_.map_from_keyframe, solved)).max() < 0.005
    shaken = map_.map_from_keyframe + 0.05 * np.random.default_rng(0).standard_normal((len(true), 3))
    shaken[0] = map_.map_from_keyframe[0]
    assert np.abs(between(map_.map_from_keyframe, graph.optimize(shaken))).max() < 0.005


def test_a_place_that_was_not_passed_again_is_not_forgotten() -> None:
    whole = session(RING, path(0.0, 34.0), IDENTITY, IDENTITY)
    map_ = whole
    for start in (0.0, 0.5, 1.0):
        map_ = forget_outdated(carried_on(map_, path(start, 20.0)))
    of_first = map_.map_from_keyframe[map_.times.drives == 0]
    far = path(0.0, 34.0)
    far = far[(np.arange(len(far)) > 80) & (np.arange(len(far)) < 98)]
    for pose in far:
        assert np.abs(between(pose, of_first)).max(axis=1).min() < 0.01


def short_sighted(drive: Session, reach: float) -> Session:
    """The same with a laser that sees no farther than so many metres, and nothing there."""
    ends = [rays.ends * np.minimum(reach / np.hypot(*rays.ends.T), 1.0)[:, None] for rays in drive.rays]
    return replace(drive, rays=[Rays.to(each, 0) for each in ends])


def seen_cells(map_: Session) -> np.ndarray:
    """Whether each cell of 0.25 m was seen."""
    box = np.array([-7.0, -5.0]), np.array([7.0, 5.0])
    config = RenderingConfig(margin=20.0)
    grid = render(map_.rays, map_.map_from_keyframe, map_.times.drives, 0.25, config, box)
    return grid.in_one_piece().cells != UNKNOWN


def test_what_no_later_drive_could_see_stays() -> None:
    whole = session(RING, path(0.0, 34.0), IDENTITY, IDENTITY)
    map_ = whole
    for start in (3.0, 7.0, 12.0, 20.0):
        true = path(start, 34.0)
        map_ = carried_on(map_, true)
        is_last = map_.times.drives == map_.times.drives[-1]
        dim = short_sighted(map_.only(is_last), 0.7)
        map_.rays[-len(dim.rays) :] = dim.rays
        map_ = forget_outdated(map_)
    before, after = seen_cells(whole), seen_cells(map_)
    assert seen_cells(map_.only(map_.times.drives == map_.times.drives[-1])).sum() < 0.9 * before.sum()
    assert (before & ~after).sum() <= 0.05 * before.sum()
    assert (map_.times.drives == 0).sum() < 0.5 * len(whole.rays)


def test_two_drives_forget_nothing() -> None:
    joint = carried_on(session(RING, path(0.0, 34.0), IDENTITY, IDENTITY), path(3.0, 34.0))
    assert forget_outdated(joint) is joint
