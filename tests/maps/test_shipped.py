"""The places that come with the project are what they claim."""

import numpy as np
import pytest
from scipy.ndimage import label

from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_names


@pytest.mark.parametrize("name", sorted({*shipped_names()} - {"campus"}))
def test_every_plan_is_one_connected_floor_within_walls(name: str) -> None:
    cells = load_map(name).cells
    assert label(cells == 0)[1] == 1
    edge = np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]])
    assert np.all(edge == -1)
    free_beside_unknown = (cells[1:, 1:] == 0) & ((cells[:-1, 1:] == -1) | (cells[1:, :-1] == -1))
    assert not free_beside_unknown.any()


def test_the_building_is_about_fifty_by_thirty() -> None:
    grid = load_map("building")
    rows, columns = np.nonzero(grid.cells == 0)
    assert np.ptp(columns) * grid.resolution == pytest.approx(50.0, abs=2.0)
    assert np.ptp(rows) * grid.resolution == pytest.approx(30.0, abs=2.0)


def test_the_twin_corridors_are_identical() -> None:
    grid = load_map("twin_corridors")
    columns = slice(*grid.cell_of([[-2.0, 0.0], [32.0, 0.0]])[:, 1])
    south, north = grid.cell_of([[0.0, 0.0], [0.0, 6.0]])[:, 0]
    np.testing.assert_array_equal(
        grid.cells[south - 30 : south + 30, columns], grid.cells[north - 30 : north + 30, columns]
    )


def test_the_bare_corridor_shows_nothing_along_it() -> None:
    grid = load_map("bare_corridor")
    columns = slice(*grid.cell_of([[5.0, 0.0], [59.0, 0.0]])[:, 1])
    assert np.all(grid.cells[:, columns] == grid.cells[:, columns.start : columns.start + 1])


def test_the_long_track_is_a_kilometre_and_has_no_shorter_loop() -> None:
    grid = load_map("long_track")
    assert np.count_nonzero(grid.cells == 0) * 0.05**2 / 2.4 > 850.0
    assert label(grid.cells != 0)[1] == 2  # outside and inside: one ring, so one loop


def test_the_campus_is_ways_through_a_lawn_that_is_looked_over() -> None:
    grid = load_map("campus")
    ways, count = label(grid.cells == 0)
    assert count == 1
    assert np.count_nonzero(ways) * grid.resolution**2 / 3.0 > 350.0
    assert not np.any(grid.cells[[0, -1]] == 100) and not np.any(grid.cells[:, [0, -1]] == 100)
    in_field = cast_ray_fan(grid, [[80.0, 1.6, 0.0]], np.radians(np.arange(15.0, 165.0)), 200.0)[0]
    assert in_field.min() > 30.0
    between_houses = cast_ray_fan(grid, [[0.0, 0.0, 0.0]], np.radians(np.arange(-180.0, 180.0)), 200.0)[0]
    assert np.median(between_houses) < 15.0
