"""What moves along with the laser is seen in the same place whatever the world, and hides what is behind."""

import numpy as np
import pytest

from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.laser_models import LASERS, UST_10LX
from racecar.pipelines.simulation.simulator_config import LaserKind
from racecar.pipelines.simulation.surroundings import see_carrier, see_posts
from racecar.pipelines.simulation.walkers import Follower
from racecar.pipelines.simulation.wheel_odometry import is_carried


@pytest.mark.parametrize("kind", list(LaserKind))
def test_as_many_posts_are_seen_as_there_are(kind: LaserKind) -> None:
    for seed in range(5):
        ranges = see_posts(4, LASERS[kind], np.random.default_rng(seed))
        is_post = np.isfinite(ranges)
        assert np.count_nonzero(np.diff(is_post.astype(int), prepend=0) > 0) in (3, 4)  # two may touch
        assert 0.01 < is_post.mean() < 0.25
        assert ranges.min() > 0.16 and ranges[is_post].max() < 0.36
    assert np.all(np.isinf(see_posts(0, LASERS[kind], np.random.default_rng(0))))


def test_a_carrier_hides_half_of_the_view_from_close_by() -> None:
    bodies = np.array([see_carrier(UST_10LX, seconds) for seconds in np.arange(0.0, 3.0, 0.1)])
    is_body = np.isfinite(bodies)
    assert np.all(is_body == is_body[0])
    assert is_body[0].mean() == pytest.approx(0.5, abs=0.01)
    assert bodies[is_body].min() >= 0.2 and bodies[is_body].max() <= 0.3
    assert np.ptp(bodies[:, 0]) > 0.01


def test_a_car_is_carried_for_so_long_of_each_half_minute() -> None:
    seconds = np.arange(0.0, 120.0, 0.1)
    carried = is_carried(seconds, 10.0)
    assert carried.mean() == pytest.approx(1 / 3, abs=0.01)
    assert not carried[0] and carried[250]
    assert not is_carried(seconds, 0.0).any()
    assert is_carried(seconds, 30.0).all()


def test_a_follower_keeps_some_metres_behind_and_walks_the_same_way() -> None:
    seconds = TICK * np.arange(8001)
    drive = CarMotion(
        np.column_stack([np.minimum(seconds, 30.0), 0.0 * seconds, 0.0 * seconds]),
        (seconds < 30.0).astype(float),
        0.0 * seconds,
    )
    follower = Follower(drive, np.random.default_rng(0))
    ticks = np.arange(0, 8000, 20)
    persons = np.array([follower.legs_at(int(tick)).mean(axis=0) for tick in ticks])
    behind = drive.map_from_base[ticks, 0] - persons[:, 0]
    assert behind.min() >= 1.9 and behind.max() <= 3.1
    np.testing.assert_allclose(persons[:, 1], 0.0, atol=1e-9)
    assert np.ptp(behind[seconds[ticks] < 30.0]) > 0.5
    feet = np.array([follower.legs_at(int(tick)) for tick in ticks])
    assert np.abs(feet[:, 0] - feet[:, 1]).max() > 0.3


def test_a_car_that_reverses_pushes_the_follower_before_it() -> None:
    x = -TICK * np.arange(2001.0)
    follower = Follower(
        CarMotion(np.column_stack([x, 0 * x, 0 * x]), 0 * x - 1.0, 0 * x), np.random.default_rng(0)
    )
    assert x[2000] - follower.legs_at(2000).mean(axis=0)[0] == pytest.approx(1.0, abs=0.01)
