import numpy as np
import pytest

from racecar.localization.recovery.lookout import Lookout
from racecar.localization.recovery.perception import Perception
from racecar.maps.geometry.se2 import Pose, compose
from tests.localization.corridors import seen_in_corridor, slanted_corridor
from tests.localization.scans import points_from
from tests.sensors.drives import room

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
