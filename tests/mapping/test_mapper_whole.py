"""A mapper is read by other threads while it maps, and some of its scans fail: it stays whole."""

import pickle
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event
from typing import Any

import numpy as np
import pytest

from racecar.mapping import mapper as mapper_module
from racecar.mapping import schedule
from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.drive import Drive
from racecar.mapping.keyframes.placement import KeyframePlacer
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.mapper import Mapper
from racecar.mapping.state import trimming
from racecar.mapping.state.mapper_state import MapperState
from racecar.maps.geometry.se2 import IDENTITY, between
from racecar.sensors.motion.dead_reckoning import DeadReckoning
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.mapping.mapped import feed, missed
from tests.sensors.drives import pose_at, room, sweep

EVERY, SPEED, BEAMS = 0.4, 1.5, 60
"""Seconds from scan to scan, m/s, and beams: each scan is a keyframe, at little cost."""


def laps(scans: int, seed: int = 0) -> Iterator[Odometry | Scan]:
    """Scan after scan round and round a room."""
    grid, rng = room(), np.random.default_rng(seed)
    bearings = np.linspace(-2.35, 2.35, BEAMS)
    start = pose_at(grid, np.zeros(1), SPEED)[0]
    for k in range(1, scans + 1):
        for part in (0.0, 0.25, 0.5, 0.75):  # wheels that are right, up to the end of the scan
            seconds = (k + part) * EVERY - 0.5 * EVERY
            odom_from_base = between(start, pose_at(grid, np.array([seconds]), SPEED)[0])
            yield Odometry(round(seconds * 1e9), odom_from_base, IDENTITY)
        yield sweep(grid, round(k * EVERY * 1e9), rng, SPEED, 0.01, bearings)


def read_everything(mapper: Mapper) -> None:
    """Whatever a mapper says is of one moment."""
    session, growth = mapper.session(), mapper.growth
    count = len(session.rays)
    assert (
        len(session.keyframes) == len(session.map_from_keyframe) == len(session.keyframe_from_base) == count
    )
    assert len(session.constraints) == 0 or session.constraints.to_arrays()["keyframes"].max() < count
    assert growth.keyframes >= count
    rays, poses, (held_rays, held_poses) = mapper.seen_so_far()
    assert len(rays) == len(poses)
    assert len(held_rays) == len(held_poses)
    assert mapper.odometry_lag.nanoseconds == 0
    assert not mapper.frozen_odometry.hangs
    assert not mapper.turn_model.is_used


def read_beside(mapper: Mapper, is_over: Event) -> int:
    reads = 0
    while not is_over.wait(0.001):
        read_everything(mapper)
        if reads % 50 == 10 and mapper.growth.keyframes:
            mapper.quality_so_far()()
        reads += 1
    return reads


@contextmanager
def switching_often() -> Iterator[None]:
    """As live nodes do."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(0.0005)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


@pytest.mark.parametrize("keyframes", [600, pytest.param(3000, marks=pytest.mark.slow)])
def test_three_threads_read_everything_while_it_maps(keyframes: int) -> None:
    mapper, is_over = Mapper(MappingConfig()), Event()
    with ThreadPoolExecutor(3) as pool, switching_often():
        readers = [pool.submit(read_beside, mapper, is_over) for _ in range(3)]
        try:
            feed(mapper, laps(keyframes))
        finally:
            is_over.set()
        assert all(reader.result() > 10 for reader in readers)
    assert mapper.growth.keyframes == keyframes
    undisturbed = Mapper(MappingConfig())
    feed(undisturbed, laps(keyframes))
    np.testing.assert_array_equal(mapper.session().map_from_keyframe, undisturbed.session().map_from_keyframe)


STAGES: list[tuple[Any, str]] = [
    (mapper_module, "prepare_scan"),
    (mapper_module, "rays_of"),
    (mapper_module, "constrain"),
    (mapper_module, "trim_scans"),
    (KeyframePlacer, "place"),
    (DeadReckoning, "advance"),
    (DeadReckoning, "start_keyframe"),
    (DeadReckoning, "learn_lag"),
    (MapperState, "by_wheels"),
    (MapperState, "calibrate"),
    (PoseGraph, "add"),
    (PoseGraph, "optimize_since"),
    (PoseGraph, "close"),
    (LoopCloser, "learn_drift"),
    (LoopCloser, "close"),
    (Drive, "start_keyframe"),
    (trimming, "matches_with_known"),
]


@pytest.mark.parametrize(("owner", "name"), STAGES, ids=[name for _, name in STAGES])
def test_a_scan_that_fails_anywhere_costs_that_scan(
    owner: Any, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    works: Callable[..., Any] = getattr(owner, name)
    calls = 0

    def fails_often(*arguments: Any, **options: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls % 7 == 3:
            raise RuntimeError("for a test")
        return works(*arguments, **options)

    monkeypatch.setattr(schedule, "PACKING_INTERVAL", 50)
    mapper, failed = Mapper(MappingConfig()), 0
    with monkeypatch.context() as patch:
        patch.setattr(owner, name, fails_often)
        for message in laps(120):
            try:
                feed(mapper, [message])
            except RuntimeError:
                failed += 1
                read_everything(mapper)
    assert pickle.loads(pickle.dumps(mapper)).growth == mapper.growth
    assert failed or calls < 3
    assert mapper.growth.keyframes >= 120 - failed
    assert np.isclose(mapper.growth.metres, 120 * EVERY * SPEED, rtol=0.5)
    trajectory = mapper.finish().trajectory
    truth = pose_at(room(), trajectory.stamps * 1e-9, SPEED)
    assert missed(trajectory.map_from_base, truth).max() < 0.2
