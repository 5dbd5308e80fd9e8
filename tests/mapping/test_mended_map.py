"""A car whose laser is covered for a while, in which its wheels slip: the next round of the room contradicts
the first, and the drive misses the loop."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.maps.geometry.se2 import between, compose
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import drive, room

COVERED = (11_000_000_000, 14_000_000_000)
SLIP = np.array([0.5, -0.4, 0.2])


@cache
def mapped(rounds: int, *, close_loops: bool = True) -> tuple[MapQuality, float]:
    """The verdict on the map, and the mean error in metres of the poses seen from the first one."""
    driven = drive(room(), 24.0, np.random.default_rng(1), bearings=np.linspace(-0.6, 0.6, 100))
    config = MappingConfig(refine=False, close_loops=close_loops)
    mapper, slipped_at = Mapper(config), None
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("racecar.mapping.mapper.FEEDBACK_ROUNDS", rounds)
        patched.setattr("racecar.mapping.loops.candidate_search._MIN_DRIFT", 100.0)  # loops are missed
        for message in driven.messages:
            if isinstance(message, Scan):
                is_covered = COVERED[0] < message.stamp < COVERED[1]
                ranges = np.full_like(message.ranges, np.inf) if is_covered else message.ranges
                mapper.add_scan(replace(message, ranges=ranges))
                continue
            pose = message.odom_from_base
            if message.stamp > sum(COVERED) / 2:
                slipped_at = pose if slipped_at is None else slipped_at
                pose = compose(compose(slipped_at, SLIP), between(slipped_at, pose))
            mapper.add_odometry(Odometry(message.stamp, pose, message.twist))
        result = mapper.finish()
    found, truth = result.trajectory.map_from_base, driven.truth
    errors = between(between(truth[0], truth), between(found[0], found))
    return result.quality, float(np.hypot(errors[:, 0], errors[:, 1]).mean())


def test_a_map_whose_passes_contradict_each_other_is_mended() -> None:
    (torn, torn_by), (mended, mended_by) = mapped(0), mapped(3)
    assert torn.verdict == Verdict.WRONG
    assert torn_by > 0.2
    assert mended.verdict == Verdict.GOOD
    assert mended.is_better_than(torn)
    assert mended_by < 0.08


def test_without_loop_closure_nothing_is_mended() -> None:
    quality, error = mapped(3, close_loops=False)
    assert quality.verdict == Verdict.WRONG
    assert error > 0.2
