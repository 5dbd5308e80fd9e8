"""Steps of the path that no car drives."""

import numpy as np
import pytest

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.jumps import jumps
from racecar.mapping.quality.map_quality import Verdict
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse
from tests.mapping.sessions import as_two_recordings, chain, plain_map
from tests.sensors.worlds import ROOM, store_of

COUNT = 41
MOUNTS = np.array([[0.4, 0.0, 0.0], [-0.8, 0.0, np.pi]])


def drive(jump: float = 0.0, seconds: float = 0.25, base_from_laser: Pose = IDENTITY) -> FinishedMap:
    """At 1 m/s, and farther in the twentieth step, which takes so many seconds."""
    base = np.column_stack([np.linspace(-1.0, 1.0, COUNT), np.zeros((COUNT, 2))])
    base[20:, 0] += jump
    poses = compose(base, np.broadcast_to(base_from_laser, base.shape))
    lasers_from_base = inverse(np.broadcast_to(base_from_laser, base.shape))
    at = 0.05 * np.arange(COUNT)
    at[20:] += seconds - 0.05
    ties = chain(poses, np.diag([1e4, 1e4, 1e5]))
    return plain_map(store_of(ROOM, poses), poses, ties, at, lasers_from_base)


def test_a_step_counts_as_far_as_it_is_longer_than_the_car_drives_in_its_time() -> None:
    beyond = jumps(drive(jump=1.95))
    assert np.flatnonzero(beyond).tolist() == [19]
    assert beyond[19] == pytest.approx(2.0 - 1.5 * 0.25)


@pytest.mark.parametrize(
    "map_",
    [
        drive(seconds=0.05),
        drive(jump=1.95, seconds=2.0),  # so far away it was started again
        drive(seconds=0.05, base_from_laser=np.tile(MOUNTS, (COUNT, 1))[:COUNT]),  # two lasers in turn
        as_two_recordings(drive(jump=1.95), 20),
    ],
)
def test_nothing_jumps_that_was_driven(map_: FinishedMap) -> None:
    assert jumps(map_).max() < 1e-9


def test_a_map_whose_path_jumps_is_doubtful_and_says_where() -> None:
    quality = judge(drive(jump=1.95), QualityConfig())
    assert quality.verdict != Verdict.GOOD
    assert "jumps by 1.6 m" in quality.doubts[0]
    assert "the path jumps by 1.6 m" in quality.segments[0].why
    assert quality.segments[0].keyframes == (19, 20)


def test_a_map_whose_path_does_not_jump_is_not_told_of_one() -> None:
    quality = judge(drive(), QualityConfig())
    assert quality.statistics["jump_m"] == 0.0
    assert not any("jumps" in reason for reason in quality.reasons)
