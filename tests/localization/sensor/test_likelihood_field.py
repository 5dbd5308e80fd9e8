import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from racecar.localization.floor.walls import find_walls
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.likelihood_field import LikelihoodField
from racecar.maps.geometry.se2 import Pose, compose, transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, free_space_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room

SQUASH, FIELD = CONFIG.squash, CONFIG.likelihood_field
ANYWHERE = FIELD.random / (FIELD.random_range / 0.05)
"""Probability of an end anywhere, per 5 cm."""


def field(grid: OccupancyGrid) -> LikelihoodField:
    return LikelihoodField(free_space_of(grid), find_walls(grid), FIELD, SQUASH)


def measured_from(grid: OccupancyGrid, pose: Pose) -> Beams:
    ranges = cast_ray_fan(grid, compose(pose, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    return Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0)


def ends_on_map(poses: Pose, beams: Beams) -> np.ndarray:
    """(N, M, 2)"""
    x, y = beams.ranges * np.cos(beams.bearings), beams.ranges * np.sin(beams.bearings)
    ends = np.column_stack([x, y])[np.isfinite(beams.ranges)]
    return np.array([transform_points(compose(pose, beams.base_from_laser), ends) for pose in poses])


def cells_to_wall(grid: OccupancyGrid, points: np.ndarray) -> np.ndarray:
    """(N, M) whole cells, at most 255 as off the grid."""
    away = np.minimum(np.rint(distance_transform_edt(grid.cells < OCCUPIED)), 255.0)
    cells = grid.cell_of(points.reshape(-1, 2))
    inside = grid.contains(cells)
    cells_away = np.full(len(cells), 255.0)
    cells_away[inside] = away[tuple(cells[inside].T)]
    return cells_away.reshape(points.shape[:2])


def plain_log_likelihood(grid: OccupancyGrid, poses: Pose, beams: Beams) -> np.ndarray:
    off = cells_to_wall(grid, ends_on_map(poses, beams)) * grid.resolution / FIELD.hit_deviation
    hit = np.exp(-0.5 * off**2) / (FIELD.hit_deviation / 0.05 * np.sqrt(2 * np.pi))
    return np.asarray(np.log(FIELD.hit * hit + ANYWHERE).sum(axis=1) / SQUASH)


def poses_about(pose: Pose, grid: OccupancyGrid, spread: float) -> Pose:
    rng = np.random.default_rng(0)
    poses = pose + [spread, spread, 1.0] * rng.standard_normal((300, 3))
    return np.asarray(poses[free_space_of(grid).contains(poses[:, :2])])


def test_it_is_the_sum_over_the_ends_of_the_beams() -> None:
    grid = room()
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    beams, poses = measured_from(grid, truth), poses_about(truth, grid, 1.5)
    plain = plain_log_likelihood(grid, poses, beams)
    fast = field(grid).log_likelihood(poses, beams)
    assert np.ptp(plain) > 100.0
    np.testing.assert_allclose(fast, plain, atol=0.6)
    assert np.median(np.abs(fast - plain)) < 0.02


def test_the_right_place_is_the_likeliest() -> None:
    grid = room()
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    poses = np.vstack([truth, poses_about(truth, grid, 1.5)])
    assert np.argmax(field(grid).log_likelihood(poses, measured_from(grid, truth))) == 0


def test_misses_do_not_count() -> None:
    grid = room()
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    seen, poses = measured_from(grid, truth), poses_about(truth, grid, 0.5)
    with_misses = Beams(
        np.append(seen.bearings, [0.1, 0.2]), np.append(seen.ranges, [np.inf, np.inf]), BASE_FROM_LASER, 30.0
    )
    model = field(grid)
    np.testing.assert_array_equal(model.log_likelihood(poses, with_misses), model.log_likelihood(poses, seen))
    assert model.fits(poses, with_misses)[:, -2:].all()


def test_where_the_car_cannot_be_is_as_unlikely_as_ends_off_the_map() -> None:
    grid = room()
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    beams = measured_from(grid, truth)
    in_wall = compose(grid.map_from_grid, [0.1, 4.0, 0.0])
    least, off_map, in_the_wall, right = field(grid).log_likelihood(
        np.array([[1e5, 0.0, 0.0], [-1e6, 1e6, 1.0], in_wall, truth]), beams
    )
    assert (
        least == off_map == in_the_wall == pytest.approx(len(BEARINGS) * np.log(ANYWHERE) / SQUASH, rel=1e-4)
    )
    assert right > least + 100.0


def test_a_beam_fits_where_it_ends_near_a_wall() -> None:
    grid = room()
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    beams, poses = measured_from(grid, truth), poses_about(truth, grid, 0.4)
    expected = cells_to_wall(grid, ends_on_map(poses, beams)) * grid.resolution <= 0.2
    assert 0.2 < expected.mean() < 0.8
    np.testing.assert_array_equal(field(grid).fits(poses, beams), expected)
