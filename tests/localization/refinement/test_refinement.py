import numpy as np
import pytest

from racecar.localization.floor.walls import find_walls
from racecar.localization.refinement.config import AlignmentConfig
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

CLOUD = np.diag([0.01, 0.01, 0.0025])


@pytest.mark.parametrize("seed", range(5))
def test_people_do_not_draw_the_estimate_aside(seed: int) -> None:
    grid, rng = room(), np.random.default_rng(seed)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    ranges = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    ranges[100:160] *= rng.uniform(0.6, 0.95, 60)
    beams = Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0)
    start = compose(truth, [0.15, -0.1, 0.04])
    refined, covariance = refine(start, CLOUD, beams, find_walls(grid), AlignmentConfig())
    assert np.sqrt(np.trace(covariance[:2, :2])) < 0.05
    assert np.hypot(*(refined - truth)[:2]) < 0.03
    assert abs(refined[2] - truth[2]) < 0.01


def test_along_a_bare_corridor_the_estimate_stays() -> None:
    cells = np.full((60, 2000), FREE, dtype=np.int8)
    cells[:10], cells[50:] = OCCUPIED, OCCUPIED
    grid = OccupancyGrid(cells, 0.05, IDENTITY)
    truth = np.array([50.0, 1.5, 0.0])
    ranges = cast_ray_fan(grid, truth[None], BEARINGS, 10.0)[0]
    beams = Beams(BEARINGS, ranges, IDENTITY, 10.0)
    start = np.add(truth, [0.1, 0.1, 0.02])
    refined, covariance = refine(start, CLOUD, beams, find_walls(grid), AlignmentConfig())
    assert abs(refined[0] - truth[0] - 0.1) < 0.02
    assert abs(refined[1] - truth[1]) < 0.02
    assert abs(refined[2]) < 0.005
    along, across = np.sqrt(np.diag(covariance)[:2])
    assert along > 0.09
    assert across < 0.03


def test_too_few_points_change_nothing() -> None:
    start = np.array([1.0, 2.0, 0.3])
    beams = Beams(BEARINGS[:5], np.ones(5), IDENTITY, 10.0)
    assert refine(start, CLOUD, beams, find_walls(room()), AlignmentConfig()) == (start, CLOUD)
