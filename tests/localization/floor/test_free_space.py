import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor import patches
from racecar.localization.floor.free_space import Region, find_free_space
from racecar.localization.floor.patches import patch_sizes, spread, strips
from racecar.localization.localizer import Localizer
from racecar.localization.recovery.perception import refuse_empty
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from tests.localization.scenes import MIDDLE, corner, furnished, hall, rectangle

angles = st.floats(-np.pi, np.pi)
lengths = st.floats(0.2, 2.0)
points = st.tuples(st.floats(3.0, 7.0), st.floats(3.0, 5.0)).map(np.array)


def test_unreachable_specks_and_the_floor_around_a_track_are_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cells = np.full((200, 200), FREE, dtype=np.int8)
    cells[50:150, 50:150] = OCCUPIED
    cells[60:140, 60:140] = FREE
    cells[54:56, 54:56] = FREE
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    assert find_free_space(grid).cell_count == 80 * 80 + 200 * 200 - 100 * 100
    monkeypatch.setattr("racecar.localization.floor.free_space._MOST_CELLS", 10_000)
    assert find_free_space(grid).cell_count == 80 * 80


def test_unknown_floor_beside_free_floor_counts_as_a_place_but_not_what_lies_behind_a_wall() -> None:
    cells = np.full((100, 100), UNKNOWN, dtype=np.int8)
    cells[20:80, 20:50] = FREE
    cells[10:90, 49:51] = OCCUPIED
    is_open = find_free_space(OccupancyGrid(cells, 0.1, IDENTITY)).is_open
    assert is_open[50, 12]
    assert not is_open[50, 5]
    assert not is_open[50, 52]


def test_a_map_without_floor_is_a_sentence() -> None:
    blocked = OccupancyGrid(np.full((20, 20), OCCUPIED, dtype=np.int8), 0.1, IDENTITY)
    with pytest.raises(UserError, match="no free cells"):
        refuse_empty(blocked)


@settings(max_examples=40)
@given(points, lengths, lengths, angles)
def test_a_lone_obstacle_is_movable_and_nothing_else_is(
    center: np.ndarray, length: float, width: float, yaw: float
) -> None:
    box = rectangle(hall(), center, length, width, yaw)
    free_space = find_free_space(furnished(hall(), box))
    np.testing.assert_array_equal(free_space.is_movable, box)
    assert not np.any(free_space.is_open & box)
    np.testing.assert_array_equal(free_space.is_standable, hall().cells == FREE)


@settings(max_examples=40)
@given(angles)
def test_an_obstacle_with_a_corner_is_movable_at_any_orientation(yaw: float) -> None:
    ell = corner(hall(), yaw)
    np.testing.assert_array_equal(find_free_space(furnished(hall(), ell)).is_movable, ell)


@settings(max_examples=40)
@given(st.floats(1.0, 2.0), st.floats(0.8, 2.0), angles)
def test_what_an_outline_encloses_is_movable_with_it(length: float, width: float, yaw: float) -> None:
    """A laser draws the outside of furniture; what is within it stays unknown."""
    grid = hall()
    box = rectangle(grid, MIDDLE, length, width, yaw)
    within = rectangle(grid, MIDDLE, length - 0.4, width - 0.4, yaw)
    cells = furnished(grid, box).cells.copy()
    cells[within] = UNKNOWN
    free_space = find_free_space(OccupancyGrid(cells, grid.resolution, grid.map_from_grid))
    np.testing.assert_array_equal(free_space.is_movable, box)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("metres", "is_movable"), [(2.9, True), (3.0, True), (3.1, False), (5.0, False)])
def test_an_obstacle_longer_than_three_metres_is_a_wall(
    metres: float, is_movable: bool, turned: bool
) -> None:
    cells = hall().cells.copy()
    along = slice(20, 20 + round(metres / 0.1))
    cells[(along, slice(40, 43)) if turned else (slice(40, 43), along)] = OCCUPIED
    movable = find_free_space(OccupancyGrid(cells, 0.1, IDENTITY)).is_movable
    assert np.count_nonzero(movable) == (3 * round(metres / 0.1) if is_movable else 0)


def test_what_leans_on_a_wall_is_part_of_it() -> None:
    cells = hall().cells.copy()
    cells[2:10, 40:50] = OCCUPIED
    assert not find_free_space(OccupancyGrid(cells, 0.1, IDENTITY)).is_movable.any()


def test_an_obstacle_where_no_car_drives_is_not_movable() -> None:
    cells = np.full((80, 200), UNKNOWN, dtype=np.int8)
    cells[:, :100] = hall().cells
    cells[40:44, 150:156] = OCCUPIED
    assert not find_free_space(OccupancyGrid(cells, 0.1, IDENTITY)).is_movable.any()


@settings(max_examples=40)
@given(points, st.floats(0.3, 3.0))
def test_the_places_about_a_point_are_no_farther_than_said(point: np.ndarray, metres: float) -> None:
    grid = hall()
    free_space = find_free_space(grid)
    point_in_map = grid.center_of(np.array([point[::-1] / grid.resolution - 0.5]))[0]
    near = free_space.within(Region(point_in_map, metres))
    away = np.hypot(*(grid.center_of(np.argwhere(near.is_open)) - point_in_map).T)
    assert away.max() <= metres + grid.resolution
    everywhere = np.hypot(*(grid.center_of(np.argwhere(free_space.is_open)) - point_in_map).T)
    assert near.cell_count >= np.count_nonzero(everywhere <= metres - grid.resolution)


def test_drawn_poses_lie_on_free_space_and_face_all_ways() -> None:
    free_space = find_free_space(furnished(hall(), rectangle(hall(), MIDDLE, 2.0, 1.0, 0.4)))
    poses = free_space.draw_poses(5000, np.random.default_rng(0))
    assert np.all(free_space.contains(poses[:, :2]))
    quarters, _ = np.histogram(poses[:, 2], bins=4, range=(-np.pi, np.pi))
    assert quarters.sum() == 5000
    assert quarters.min() > 1100


@pytest.mark.parametrize("cells", [1, 40, 10**6])
def test_strips_change_nothing(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patches, "_CELLS", cells)
    labels = np.random.default_rng(0).integers(0, 7, (53, 11), dtype=np.int32)
    assert np.array_equal(patch_sizes(labels, 7), np.bincount(labels.ravel(), minlength=8))
    values = np.arange(8.0) ** 2
    assert np.array_equal(spread(values, labels), values[labels])
    rows = list(strips((53, 11), 4))
    assert np.array_equal(np.concatenate([np.arange(53)[part] for part in rows]), np.arange(53))
    assert all(part.start % 4 == 0 for part in rows)


@pytest.mark.slow
def test_a_map_of_a_huge_hall_takes_little_memory() -> None:
    """16 bytes a cell and some, and 200 MB of views; it was 110 bytes a cell."""
    cells = np.full((4000, 4000), FREE, dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]], cells[2000, 100:3900] = OCCUPIED, OCCUPIED, OCCUPIED
    tracemalloc.start()
    Localizer(OccupancyGrid(cells, 0.05, IDENTITY), LocalizationConfig(), np.random.default_rng(0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * cells.size + 200e6
