"""What a map forgets when later drives have shown the same places."""

from collections.abc import Iterator

import numpy as np

from racecar.mapping.graph.config import PoseGraphConfig
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.config import RevisitConfig
from racecar.mapping.loops.config import LoopClosureConfig
from racecar.mapping.session.config import PlaceRecognitionConfig
from racecar.mapping.session.earlier_map import EarlierMap
from racecar.mapping.session.forgetting import forget_outdated
from racecar.mapping.session.merging import merge
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from tests.mapping.ring_drives import RING, path, session

ELSEWHERE = np.array([40.0, -25.0, 2.5])
CONFIG = RevisitConfig()


def carried_on(earlier: Session, true: Pose) -> Session:
    """An earlier session and a drive along ``true`` (K, 3), which is found there."""

    def find(later: Session) -> Iterator[Pose]:
        yield from true

    later = session(RING, true, ELSEWHERE, IDENTITY)
    recognition = PlaceRecognitionConfig()
    return merge(EarlierMap(earlier, find), later, LoopClosureConfig(), recognition, PoseGraphConfig())


def rounds(starts: list[float], metres: float) -> tuple[Session, Pose]:
    """Drives from some places of the ring, each of which carries the map on; and where all that is left was
    taken."""
    true = path(starts[0], metres)
    map_ = session(RING, true, IDENTITY, IDENTITY)
    for start in starts[1:]:
        drive = path(start, metres)
        joint, true = carried_on(map_, drive), np.concatenate([true, drive])
        map_ = forget_outdated(joint, CONFIG)
        true = true[_left_of(joint, map_)]
    return map_, true


def _left_of(joint: Session, left: Session) -> np.ndarray:
    kept = {pose.tobytes() for pose in left.map_from_keyframe}
    return np.array([pose.tobytes() in kept for pose in joint.map_from_keyframe])


def test_a_map_grows_with_the_places_and_not_with_the_drives() -> None:
    few, _ = rounds([0.0, 7.0, 3.0], 34.0)
    many, true = rounds([0.0, 7.0, 3.0, 20.0, 11.0, 30.0, 5.0, 16.0], 34.0)
    one = len(path(0.0, 34.0))
    assert len(few.rays) <= 3 * one
    assert len(many.rays) <= 3 * one
    assert len(many.constraints) < 1.5 * len(few.constraints)
    assert len(many.loops.submaps) <= len(few.loops.submaps) + 3
    assert np.abs(between(true, many.map_from_keyframe)).max() < 0.02
    Session.from_arrays(many.to_arrays())


def test_what_is_left_is_as_sure_and_where_it_was() -> None:
    map_, true = rounds([0.0, 7.0, 3.0, 20.0, 11.0], 34.0)
    graph = PoseGraph(PoseGraphConfig(), map_.constraints)
    solved = graph.optimize(map_.map_from_keyframe)
    assert np.abs(between(map_.map_from_keyframe, solved)).max() < 0.005
    shaken = map_.map_from_keyframe + 0.05 * np.random.default_rng(0).standard_normal((len(true), 3))
    shaken[0] = map_.map_from_keyframe[0]
    assert np.abs(between(map_.map_from_keyframe, graph.optimize(shaken))).max() < 0.005


def test_a_place_that_was_not_passed_again_is_not_forgotten() -> None:
    whole = session(RING, path(0.0, 34.0), IDENTITY, IDENTITY)
    map_ = whole
    for start in (0.0, 0.5, 1.0):
        map_ = forget_outdated(carried_on(map_, path(start, 20.0)), CONFIG)
    of_first = map_.map_from_keyframe[map_.drives == 0]
    far = path(0.0, 34.0)
    far = far[(np.arange(len(far)) > 80) & (np.arange(len(far)) < 98)]
    for pose in far:
        assert np.abs(between(pose, of_first)).max(axis=1).min() < 0.01


def test_two_drives_forget_nothing() -> None:
    joint = carried_on(session(RING, path(0.0, 34.0), IDENTITY, IDENTITY), path(3.0, 34.0))
    assert forget_outdated(joint, CONFIG) is joint
