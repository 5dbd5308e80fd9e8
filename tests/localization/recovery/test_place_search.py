from functools import cache

import numpy as np
import pytest

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CODES, CONFIG, beam_model_of, free_space_of, table_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

WITH_TABLE = pytest.mark.parametrize("with_table", [True, False])
PLACES = [(9.0, 2.0, 0.0), (3.0, 3.0, 1.0), (7.5, 6.0, -2.0), (1.5, 6.5, 3.0)]


@cache
def free_space() -> FreeSpace:
    return free_space_of(room())


@cache
def search(with_table: bool) -> PlaceSearch:
    return PlaceSearch(free_space(), table_of(free_space()) if with_table else CODES, CONFIG.place_search)


def seen_from(pose: Pose, base_from_laser: Pose = BASE_FROM_LASER, people: float = 0.0) -> Beams:
    rng = np.random.default_rng(0)
    ranges = cast_ray_fan(room(), compose(pose, base_from_laser)[None], BEARINGS, 30.0)[0]
    ranges += 0.01 * rng.standard_normal(len(ranges))
    ranges[: round(people * len(ranges))] *= 0.5
    return Beams(BEARINGS, ranges, base_from_laser, 30.0)


def is_near(poses: Pose, truth: Pose) -> np.ndarray:
    off = np.abs(between(truth, poses))
    return np.asarray((np.hypot(off[:, 0], off[:, 1]) < 0.4) & (off[:, 2] < 0.2))


@WITH_TABLE
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("people", [0.0, 0.2])
def test_the_place_is_found(place: tuple[float, float, float], people: float, with_table: bool) -> None:
    truth = compose(room().map_from_grid, place)
    beams = seen_from(truth, people=people)
    found = search(with_table).find(beams, 2.2, 8000, np.random.default_rng(0))
    assert found.shape == (8000, 3)
    assert is_near(found, truth).mean() > 0.05
    model = beam_model_of(free_space())
    best = found[np.argmax(model.log_likelihood(found, beams))]
    assert is_near(best[None], truth)[0]


@WITH_TABLE
def test_the_headings_that_are_found_lean_to_no_side(with_table: bool) -> None:
    offs = []
    for yaw in np.linspace(-np.pi, np.pi, 40, endpoint=False):
        truth = compose(room().map_from_grid, (3.0, 3.0, yaw))
        found = search(with_table).find(seen_from(truth, IDENTITY), 2.2, 300, np.random.default_rng(0))
        offs.append(np.median(between(truth, found[is_near(found, truth)])[:, 2]))
    assert abs(np.mean(offs)) < np.radians(0.3)


def test_what_is_found_is_the_base_wherever_the_laser_is_on_it() -> None:
    truth = compose(room().map_from_grid, PLACES[0])
    on_the_tail = np.array([-0.4, 0.2, 2.0])
    found = search(True).find(seen_from(truth, on_the_tail), 2.2, 8000, np.random.default_rng(0))
    assert is_near(found, truth).mean() > 0.05


@WITH_TABLE
def test_wrong_places_are_sorted_by_how_much_they_look_alike(with_table: bool) -> None:
    shares = search(with_table).shares_when_lost(CONFIG.lost_detector)
    assert shares.shape == (12, 4)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-9)
    assert np.all(shares >= 0.0)
    assert np.all(np.diff(shares[:, :2].sum(axis=1)) >= 0.0)
    assert shares[0, :2].sum() < 0.3
    assert shares[-1, :2].sum() > 0.5
