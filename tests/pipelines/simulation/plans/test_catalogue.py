"""The shipped maps are the generator's own drawings, and the places for research are what they claim."""

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

from racecar.maps.errors import UserError
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map, shipped_names
from racecar.pipelines.simulation.plans.campus import draw_campus
from racecar.pipelines.simulation.plans.canvas import FloorCanvas
from racecar.pipelines.simulation.plans.catalogue import ON_DEMAND, SHIPPED, draw_shipped, load_or_draw
from racecar.pipelines.simulation.plans.research import (
    draw_bare_corridor,
    draw_long_track,
    draw_twin_corridors,
)
from racecar.pipelines.simulation.plans.track import lap_line


def test_the_shipped_files_are_what_the_generator_draws(tmp_path: Path) -> None:
    draw_shipped(tmp_path)
    assert shipped_names() == sorted(SHIPPED)
    for name in SHIPPED:
        for suffix in (".yaml", ".pgm"):
            drawn = (tmp_path / name).with_suffix(suffix).read_bytes()
            assert drawn == shipped_map(name).with_suffix(suffix).read_bytes()


@pytest.mark.parametrize("name", sorted({*SHIPPED, *ON_DEMAND} - {"campus"}))
def test_every_plan_is_one_connected_floor_within_walls(name: str) -> None:
    cells = load_or_draw(Path(name)).cells
    assert label(cells == 0)[1] == 1
    edge = np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]])
    assert np.all(edge == -1)
    free_beside_unknown = (cells[1:, 1:] == 0) & ((cells[:-1, 1:] == -1) | (cells[1:, :-1] == -1))
    assert not free_beside_unknown.any()


def test_the_building_is_about_fifty_by_thirty() -> None:
    grid = load_map(shipped_map("building"))
    rows, columns = np.nonzero(grid.cells == 0)
    assert np.ptp(columns) * grid.resolution == pytest.approx(50.0, abs=2.0)
    assert np.ptp(rows) * grid.resolution == pytest.approx(30.0, abs=2.0)


def test_the_lap_is_about_sixty_metres_and_two_wide() -> None:
    line = lap_line()
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(60.0, abs=5.0)
    free = np.count_nonzero(load_map(shipped_map("track")).cells == 0) * 0.05**2
    assert 2.0 < free / 60.0 < 2.6


def test_the_twin_corridors_are_identical() -> None:
    grid = draw_twin_corridors(length=40.0, apart=6.0)
    columns = slice(*grid.cell_of([[-2.0, 0.0], [32.0, 0.0]])[:, 1])
    south, north = grid.cell_of([[0.0, 0.0], [0.0, 6.0]])[:, 0]
    np.testing.assert_array_equal(
        grid.cells[south - 30 : south + 30, columns], grid.cells[north - 30 : north + 30, columns]
    )


def test_the_bare_corridor_shows_nothing_along_it() -> None:
    grid = draw_bare_corridor(length=60.0)
    columns = slice(*grid.cell_of([[5.0, 0.0], [59.0, 0.0]])[:, 1])
    assert np.all(grid.cells[:, columns] == grid.cells[:, columns.start : columns.start + 1])


def test_the_long_track_is_a_kilometre_and_has_no_shorter_loop() -> None:
    grid = draw_long_track()
    assert np.count_nonzero(grid.cells == 0) * 0.05**2 / 2.4 > 850.0
    assert label(grid.cells != 0)[1] == 2  # outside and inside: one ring, so one loop


def test_the_campus_is_ways_through_a_lawn_that_is_looked_over() -> None:
    grid = draw_campus()
    ways, count = label(grid.cells == 0)
    assert count == 1
    assert np.count_nonzero(ways) * grid.resolution**2 / 3.0 > 350.0
    assert not np.any(grid.cells[[0, -1]] == 100) and not np.any(grid.cells[:, [0, -1]] == 100)
    in_field = cast_ray_fan(grid, [[80.0, 1.6, 0.0]], np.radians(np.arange(15.0, 165.0)), 200.0)[0]
    assert in_field.min() > 30.0
    between_houses = cast_ray_fan(grid, [[0.0, 0.0, 0.0]], np.radians(np.arange(-180.0, 180.0)), 200.0)[0]
    assert np.median(between_houses) < 15.0


def test_a_hedge_lets_some_beams_in() -> None:
    canvas = FloorCanvas((0.0, 0.0), (10.0, 10.0), resolution=0.1)
    canvas.open_box(0.0, 0.0, 10.0, 10.0)
    canvas.solid_thicket(6.0, 0.0, 7.0, 10.0, np.random.default_rng(0))
    depths = cast_ray_fan(canvas.finish(), [[1.0, 5.0, 0.0]], np.radians(np.arange(-30.0, 30.0)), 30.0)[0]
    depths *= np.cos(np.radians(np.arange(-30.0, 30.0)))
    assert np.all((depths > 4.99) & (depths < 6.01))
    assert 0.05 < depths.std() < 0.3


def test_an_open_place_is_walled_one_cell_thick() -> None:
    canvas = FloorCanvas((0.0, 0.0), (0.5, 0.4), resolution=0.1)
    canvas.open_box(0.1, 0.1, 0.4, 0.3)
    canvas.solid_box(0.2, 0.1, 0.3, 0.2)
    expected = [
        [100, 100, 100, 100, 100],
        [100, 0, 100, 0, 100],
        [100, 0, 0, 0, 100],
        [100, 100, 100, 100, 100],
    ]
    np.testing.assert_array_equal(canvas.finish().cells, expected)


def test_a_name_that_is_no_map_is_told() -> None:
    with pytest.raises(UserError, match="building"):
        load_or_draw(Path("castle"))
