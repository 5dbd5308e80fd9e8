"""The loops that a drive missed: two rounds of a room whose map is torn between them, so that they contradict
each other."""

from functools import cache

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.loops import consistent_support
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.mapper import Mapper
from racecar.mapping.missed_loops import missed_loops
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between, chained, compose
from racecar.sensors.scan import Scan
from tests.sensors.drives import drive, room


@cache
def mapped() -> Session:
    """Without a single loop closure or hypothesis."""
    config = MappingConfig(close_loops=False)
    mapper = Mapper(config)
    for message in drive(room(), 26.0, np.random.default_rng(1)).messages:
        if isinstance(message, Scan):
            mapper.add_scan(message)
        else:
            mapper.add_odometry(message)
    return mapper.finish().session


def torn() -> Pose:
    """The poses of the same keyframes with one step amiss, between the rounds."""
    poses = mapped().map_from_keyframe
    steps = between(poses[:-1], poses[1:])
    steps[len(steps) // 2] += np.array([0.6, -0.4, 0.25])
    return compose(poses[0], chained(steps))


def found(poses: Pose) -> list[Hypothesis]:
    session = mapped()
    map_ = FinishedMap(
        Session(
            session.keyframes,
            session.rays,
            session.keyframe_from_base,
            poses,
            session.constraints,
            LoopHistory(),
            session.drives,
        ),
        np.arange(len(poses), dtype=np.float64),
    )
    loops = LoopCloser(session.keyframes)
    for distance in np.diff(map_.path, prepend=0.0):
        loops.history.graph.add_keyframe(float(distance))
    quality = judge(map_, QualityConfig())
    return missed_loops(quality, poses, loops)


def test_passes_that_contradict_each_other_are_found_where_they_belong() -> None:
    hypotheses = found(torn())
    assert len(hypotheses) >= 2
    true = mapped().map_from_keyframe
    for h in hypotheses:
        missed = between(between(true[h.fixed.middle], true[h.moving.middle]), h.fixed_from_moving)
        assert np.hypot(missed[0], missed[1]) < 0.1
        assert abs(missed[2]) < 0.03


def test_a_good_map_is_left_as_it_is() -> None:
    assert found(mapped().map_from_keyframe) == []


def test_what_nothing_supports_is_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(consistent_support, "_MIN_SPACING", 50.0)
    assert found(torn()) == []
