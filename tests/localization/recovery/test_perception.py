from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import perception_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

TRUTH = compose(room().map_from_grid, [9.0, 4.0, 0.7])


@cache
def perception() -> Perception:
    return perception_of(room())


def cloud_about(pose: Pose) -> Pose:
    """(1000, 3) as narrow as of a car that is tracked."""
    noise = np.random.default_rng(0).standard_normal((1000, 3))
    return np.asarray(pose + np.array([0.04, 0.04, 0.01]) * noise)


def stopped_scan(share: float) -> tuple[Beams, np.ndarray]:
    """What is seen from the true pose, and which of it (B,) is something before the wall."""
    ranges = cast_ray_fan(room(), compose(TRUTH, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    is_stopped = np.random.default_rng(0).random(len(BEARINGS)) < share
    return Beams(BEARINGS, np.where(is_stopped, 0.7 * ranges, ranges), BASE_FROM_LASER, 30.0), is_stopped


@settings(max_examples=20)
@given(st.floats(0.0, 0.6))
def test_only_what_the_map_does_not_know_is_left_out(share: float) -> None:
    beams, is_stopped = stopped_scan(share)
    explained = perception().explained(cloud_about(TRUTH), beams)
    np.testing.assert_array_equal(explained.bearings, BEARINGS[~is_stopped])


def test_where_most_is_unknown_all_counts() -> None:
    beams, _ = stopped_scan(0.8)
    assert len(perception().explained(cloud_about(TRUTH), beams)) == len(beams)


@pytest.mark.parametrize("aside", [(-3.0, 1.0, 2.0), (2.0, -1.0, 0.5)])
def test_a_cloud_that_has_gone_astray_does_not_choose_what_suits_it(
    aside: tuple[float, float, float],
) -> None:
    beams, _ = stopped_scan(0.0)
    assert len(perception().explained(cloud_about(compose(TRUTH, aside)), beams)) == len(beams)


def test_misses_explain_nothing() -> None:
    beams, _ = stopped_scan(0.0)
    ranges = np.where(np.arange(len(BEARINGS)) % 2 == 0, beams.ranges, np.inf)
    missed = Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0)
    assert np.isfinite(perception().explained(cloud_about(TRUTH), missed).ranges).all()
    nothing = Beams(BEARINGS, np.full(len(BEARINGS), np.inf), BASE_FROM_LASER, 30.0)
    assert len(perception().explained(cloud_about(TRUTH), nothing)) == 0
