from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.recovery.lookout import Lookout
from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from tests.localization.scenes import points_at, points_from, ranges_from, seen_in_corridor, slanted_corridor
from tests.sensors.drives import BEARINGS, room

NARROW = np.diag([0.04, 0.04, 0.01]) ** 2
TRUTH = compose(room().map_from_grid, [9.0, 4.0, 0.7])


@cache
def perception() -> Perception:
    return Perception(room())


def cloud_about(pose: Pose) -> Pose:
    """(1000, 3) as narrow as of a car that is tracked."""
    noise = np.random.default_rng(0).standard_normal((1000, 3))
    return np.asarray(pose + np.sqrt(np.diag(NARROW)) * noise)


def stopped_scan(share: float) -> tuple[EndPoints, np.ndarray]:
    """What is seen from the true pose, and which of it (N,) is something before the wall."""
    ranges = ranges_from(room(), TRUTH)
    is_stopped = np.random.default_rng(0).random(len(BEARINGS)) < share
    return points_at(np.where(is_stopped, 0.7 * ranges, ranges)), is_stopped


@settings(max_examples=20)
@given(st.floats(0.0, 0.6))
def test_only_what_the_map_does_not_know_is_left_out(share: float) -> None:
    points, is_stopped = stopped_scan(share)
    explained = perception().explained(cloud_about(TRUTH), NARROW, points)
    np.testing.assert_array_equal(explained.in_base, points.in_base[~is_stopped])


def test_where_most_is_unknown_all_counts() -> None:
    points, _ = stopped_scan(0.8)
    assert len(perception().explained(cloud_about(TRUTH), NARROW, points)) == len(points)


@pytest.mark.parametrize("aside", [(-3.0, 1.0, 2.0), (2.0, -1.0, 0.5)])
def test_a_cloud_that_has_gone_astray_does_not_choose_what_suits_it(
    aside: tuple[float, float, float],
) -> None:
    points, _ = stopped_scan(0.0)
    assert len(perception().explained(cloud_about(compose(TRUTH, aside)), NARROW, points)) == len(points)


def test_of_no_points_none_are_left() -> None:
    nothing = points_at(np.full(len(BEARINGS), np.inf))
    assert len(perception().explained(cloud_about(TRUTH), NARROW, nothing)) == 0


def test_what_lies_beyond_the_map_says_nothing() -> None:
    """Of the room's map a part is cut off, as people crop images; a car that leaves the map fits nowhere."""
    grid = room()
    kept = Perception(OccupancyGrid(grid.cells[:, :140], grid.resolution, grid.map_from_grid))
    beside = compose(grid.map_from_grid, [5.0, 2.0, 0.0])
    points = points_at(ranges_from(grid, beside))
    assert kept.fit(beside, points) == pytest.approx(perception().fit(beside, points), abs=0.05)
    assert len(kept.explained(cloud_about(beside), NARROW, points)) < len(points)
    off = compose(grid.map_from_grid, [9.0, 4.0, 0.0])
    assert kept.fit(off, points_at(ranges_from(grid, off))) < 0.7


PLACES = [(9.0, 2.0, 0.0), (3.0, 3.0, 1.0), (7.5, 6.0, -2.0)]


def margin_in_room(pose: Pose, truth: Pose) -> float:
    """Of a whole round, taken at a pose for the scan from another."""
    look = Lookout().look(pose, points_from(room(), truth).thinned(100), 1.0, Perception(room()))
    assert look is not None and look.whole_margin == look.margin
    return look.margin


@pytest.mark.parametrize("place", PLACES)
def test_in_a_room_of_distinct_shape_a_scan_fits_nowhere_else(place: tuple[float, float, float]) -> None:
    truth = compose(room().map_from_grid, place)
    assert margin_in_room(truth, truth) > 2.0


@pytest.mark.parametrize("place", PLACES)
def test_at_a_wrong_place_it_fits_better_elsewhere(place: tuple[float, float, float]) -> None:
    truth = compose(room().map_from_grid, place)
    for wrong in PLACES:
        if wrong != place:
            assert margin_in_room(compose(room().map_from_grid, wrong), truth) < -4.0


def test_along_a_bare_corridor_it_fits_as_well_elsewhere() -> None:
    truth, points = seen_in_corridor(0.0, 0.0, 0.1, np.random.default_rng(0))
    perception = Perception(slanted_corridor(0.0, 0.05))
    lookout, margin = Lookout(), None
    while margin is None:
        look = lookout.look(truth, points, 1.0, perception)
        assert look is not None
        margin = look.whole_margin
    assert abs(margin) < 2.0


def test_a_round_over_all_of_the_map_is_as_good_as_its_worst_part() -> None:
    truth = compose(room().map_from_grid, PLACES[0])
    perception, points = Perception(room()), points_from(room(), truth).thinned(100)
    whole_at_once = Lookout().look(truth, points, 1.0, perception)
    assert whole_at_once is not None
    lookout, looks = Lookout(), []
    while not looks or looks[-1].whole_margin is None:
        look = lookout.look(truth, points, 0.06, perception)
        assert look is not None
        looks.append(look)
    margins = [look.margin for look in looks]
    assert len(margins) > 2
    assert looks[-1].whole_margin == min(margins)
    assert min(margins) == pytest.approx(whole_at_once.margin, abs=0.5)
    assert max(margins) > min(margins) + 0.5


def test_scans_in_quick_succession_are_looked_at_together() -> None:
    truth = compose(room().map_from_grid, PLACES[0])
    perception, points = Perception(room()), points_from(room(), truth).thinned(100)
    lookout = Lookout()
    looks = [lookout.look(truth, points, 0.02, perception) for _ in range(6)]
    assert [look is not None for look in looks] == [False, False, True] * 2
    assert looks[2] is not None and looks[2].seconds == pytest.approx(0.06)
