from functools import cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.recovery.agreement import Agreement, agreement_of
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan, cast_rays
from tests.localization.floors import CONFIG, free_space_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

RULES = CONFIG.lost_detector
SIGHT = 8.0
"""Metres; less than to either end of the corridor."""


@cache
def free_space() -> FreeSpace:
    return free_space_of(room())


def agreement_in_room(map_from_base: Pose, beams: Beams) -> Agreement | None:
    return agreement_of(map_from_base, beams, free_space(), RULES)


def corridor(*, door: tuple[float, float] | None = None, pillar: float | None = None) -> OccupancyGrid:
    """40 m long and 2.4 m wide, with a door in the left wall from x to x, or a pillar in the middle at x."""
    cells = np.full((160, 800), OCCUPIED, dtype=np.int8)
    cells[56:104, 4:-4] = FREE
    if door is not None:
        cells[104:150, round(20 * door[0]) : round(20 * door[1])] = FREE
    if pillar is not None:
        cells[76:84, round(20 * pillar) : round(20 * pillar) + 8] = OCCUPIED
    return OccupancyGrid(cells, 0.05, IDENTITY.copy())


def seen_along(world: OccupancyGrid, grid: OccupancyGrid, bearings: np.ndarray = BEARINGS) -> Agreement:
    """How what the car sees in the middle of a corridor agrees with a map of it, or of another one."""
    pose = np.array([20.0, 4.0, 0.0])
    ranges = cast_ray_fan(world, pose[None], bearings, SIGHT)[0]
    agreement = agreement_of(pose, Beams(bearings, ranges, IDENTITY, SIGHT), free_space_of(grid), RULES)
    assert agreement is not None
    return agreement


@settings(max_examples=40)
@given(st.floats(0.5, 11.5), st.floats(0.5, 7.5), st.floats(-3.1, 3.1), st.integers(0, 2**32 - 1))
@example(2.5, 3.5, 0.0, 0).via("beams along the edges of cells")
def test_beams_are_sorted_by_how_they_agree(x: float, y: float, yaw: float, seed: int) -> None:
    pose = compose(room().map_from_grid, [x, y, yaw])
    laser = compose(pose, BASE_FROM_LASER)
    if not free_space().contains(laser[None, :2])[0]:
        return
    shifts = 1e-9 * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    cast = np.array([cast_rays(room(), laser + shift, BEARINGS, 30.0) for shift in shifts])
    is_sure = np.ptp(cast, axis=0) < 1e-6  # along an edge of cells, rounding decides
    assert is_sure.mean() > 0.95
    bearings, expected = BEARINGS[is_sure], cast[0, is_sure]
    within = 0.25 + 0.02 * expected
    rng = np.random.default_rng(seed)
    off = rng.choice([0.0, -0.3, 0.6, -0.9, 1.5, -2.0], len(bearings))
    beams = Beams(bearings, expected + off * within, BASE_FROM_LASER, 30.0)
    seen = agreement_in_room(pose, beams)
    wanted = [np.abs(off) <= 0.4, (np.abs(off) > 0.4) & (np.abs(off) <= 1.0), off < -1.0, off > 1.0]
    assert seen is not None
    np.testing.assert_allclose(seen.shares, [part.mean() for part in wanted], atol=1e-12)


def test_nothing_is_sure_without_beams_or_from_inside_a_wall() -> None:
    inside = compose(room().map_from_grid, [9.0, 4.0, 0.7])
    none = Beams(np.empty(0), np.empty(0), BASE_FROM_LASER, 30.0)
    some = Beams(BEARINGS, np.ones(len(BEARINGS)), BASE_FROM_LASER, 30.0)
    assert agreement_in_room(inside, none) is None
    in_wall = compose(room().map_from_grid, [0.1, 4.0, np.pi])
    for pose in (in_wall, np.array([1e6, 0.0, 0.0])):
        assert agreement_in_room(pose, some) is None
    assert agreement_in_room(inside, some) is not None


def test_a_miss_agrees_where_the_wall_is_beyond_the_sensors_sight() -> None:
    pose = compose(room().map_from_grid, [6.0, 6.0, 0.0])
    seen = agreement_in_room(pose, Beams(np.zeros(1), np.array([np.inf]), IDENTITY.copy(), 3.0))
    assert seen is not None
    np.testing.assert_array_equal(seen.shares, [1.0, 0.0, 0.0, 0.0])
    seen = agreement_in_room(pose, Beams(np.zeros(1), np.array([np.inf]), IDENTITY.copy(), 30.0))
    assert seen is not None
    np.testing.assert_array_equal(seen.shares, [0.0, 0.0, 0.0, 1.0])


def test_no_beam_tells_the_place_between_bare_walls() -> None:
    seen = seen_along(corridor(), corridor())
    assert seen.shares[0] == 1.0
    assert not seen.telling.any()


def test_what_stands_out_from_the_walls_tells_the_place() -> None:
    ahead = np.array([0.0])
    seen = seen_along(corridor(pillar=24.0), corridor(pillar=24.0), ahead)
    np.testing.assert_array_equal(seen.telling, seen.shares)


@pytest.mark.parametrize(("door", "share"), [((20.4, 20.8), 0.5), ((10.0, 10.9), 0.0)])
def test_a_beam_that_agrees_ahead_or_behind_tells_half_as_much(
    door: tuple[float, float], share: float
) -> None:
    sideways = np.array([np.pi / 2])
    seen = seen_along(corridor(door=door), corridor(door=door), sideways)
    np.testing.assert_array_equal(seen.telling, [share, 0.0, 0.0, 0.0])


def test_on_the_map_of_another_corridor_only_what_differs_tells() -> None:
    world, foreign = corridor(door=(21.5, 23.5)), corridor(pillar=24.0)
    seen = seen_along(world, foreign)
    assert seen.shares[0] > 0.8
    np.testing.assert_allclose(seen.telling[2:], seen.shares[2:], atol=0.02)
    assert seen.telling[0] < 0.2 * seen.telling.sum()
