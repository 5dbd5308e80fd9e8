import numpy as np
import pytest

from racecar.localization.sensor.beam_table import beam_probabilities
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, beam_model_of, free_space_of
from tests.localization.furniture import MIDDLE, furnished, hall, rectangle
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, room


def test_log_likelihoods_agree_with_the_product_over_exact_ranges() -> None:
    grid, rng = room(), np.random.default_rng(0)
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    bearings = BEARINGS[::5]
    measured = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], bearings, 30.0)[0]
    particles = truth + [0.5, 0.5, 0.3] * rng.standard_normal((400, 3))
    particles = particles[free_space.contains(compose(particles, BASE_FROM_LASER)[:, :2])]
    expected = cast_ray_fan(grid, compose(particles, BASE_FROM_LASER), bearings, 30.0)
    z, d = (np.minimum(np.rint(r / grid.resolution), 600).astype(int) for r in (measured, expected))
    exact = np.log(beam_probabilities(600, CONFIG.beam_model)[z[None, :], d]).sum(axis=1) / 2.2
    fast = model.log_likelihood(particles, Beams(bearings, measured, BASE_FROM_LASER, 30.0))
    assert np.corrcoef(fast, exact)[0, 1] > 0.997
    assert np.mean(np.abs(fast - exact)) < 1.0


def test_particles_off_the_map_get_the_least() -> None:
    grid = room()
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    inside = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    particles = np.array([inside, [1e6, 1e6, 0.0], compose(grid.map_from_grid, [-0.5, -0.5, 0.0])])
    beams = Beams(np.zeros(3), np.array([1.0, 2.0, np.inf]), BASE_FROM_LASER, 30.0)
    likelihood = model.log_likelihood(particles, beams)
    assert np.all(np.isfinite(likelihood))
    assert likelihood[0] > likelihood[1] == likelihood[2]


@pytest.mark.parametrize("with_table", [True, False])
def test_a_beam_fits_where_the_map_says_about_what_it_reads(with_table: bool) -> None:
    grid, rng = room(), np.random.default_rng(0)
    free_space = free_space_of(grid)
    model = beam_model_of(free_space, with_table)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    poses = truth + [0.5, 0.5, 0.3] * rng.standard_normal((200, 3))
    poses = poses[free_space.contains(compose(poses, BASE_FROM_LASER)[:, :2])]
    measured = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    exact = cast_ray_fan(grid, compose(poses, BASE_FROM_LASER), BEARINGS, 30.0)
    expected = np.abs(exact - measured) <= 0.2 + 0.02 * measured
    fits = model.fits(poses, Beams(BEARINGS, measured, BASE_FROM_LASER, 30.0))
    assert 0.2 < expected.mean() < 0.8
    assert np.mean(fits != expected) < (0.06 if with_table else 1e-9)


@pytest.mark.parametrize("with_table", [True, False])
def test_a_miss_fits_where_the_sensor_does_not_see_that_far(with_table: bool) -> None:
    grid = room()
    free_space = free_space_of(grid)
    model = beam_model_of(free_space, with_table)
    pose = compose(grid.map_from_grid, [6.0, 6.0, 0.0])
    ahead, behind = np.array([0.0]), np.array([np.pi])
    for bearing, max_range, is_fitting in (
        (ahead, 3.0, True),
        (ahead, 30.0, False),
        (behind, 3.0, True),
        (behind, 30.0, False),
    ):
        beams = Beams(bearing, np.array([np.inf]), np.zeros(3), max_range)
        assert model.fits(pose[None], beams)[0, 0] == is_fitting


def test_nothing_fits_off_the_table() -> None:
    grid = room()
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    off = np.array([[1e6, 1e6, 0.0], compose(grid.map_from_grid, [-0.5, -0.5, 0.0])])
    assert not model.fits(off, Beams(np.zeros(2), np.array([1.0, np.inf]), BASE_FROM_LASER, 30.0)).any()


def test_rays_cast_one_by_one_weigh_like_the_table() -> None:
    grid, rng = room(), np.random.default_rng(0)
    free_space = free_space_of(grid)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    measured = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    beams = Beams(BEARINGS, measured, BASE_FROM_LASER, 30.0)
    poses = truth + [0.3, 0.3, 0.2] * rng.standard_normal((200, 3))
    poses = poses[free_space.contains(compose(poses, BASE_FROM_LASER)[:, :2])]
    by_table = beam_model_of(free_space).log_likelihood(poses, beams)
    by_rays = beam_model_of(free_space, with_table=False).log_likelihood(poses, beams)
    assert np.corrcoef(by_table, by_rays)[0, 1] > 0.997
    assert np.mean(np.abs(by_table - by_rays)) < 5.0


def test_from_inside_an_obstacle_that_was_moved_the_walls_behind_it_explain_the_scan() -> None:
    """Where the map has a box, the car drives, and sees the hall as if it were bare."""
    grid = furnished(hall(), rectangle(hall(), MIDDLE, 1.4, 1.0, 0.0))
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    truth = compose(grid.map_from_grid, [*MIDDLE, 0.5])
    beams = Beams(BEARINGS, cast_ray_fan(hall(), truth[None], BEARINGS, 30.0)[0], np.zeros(3), 30.0)
    beside = compose(truth, [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, -1.5, 0.0], [0.0, 0.0, 0.6]])
    assert model.fits(truth[None], beams).mean() > 0.97
    assert np.argmax(model.log_likelihood(beside, beams)) == 0


def test_ranges_are_expected_from_where_the_laser_is_and_not_from_its_viewpoint() -> None:
    """To half a cell, in most cases; from the viewpoint they would be a cell off."""
    grid, rng = room(), np.random.default_rng(0)
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    errors = []
    for pose in free_space.draw_poses(300, rng):
        exact = cast_ray_fan(grid, pose[None], BEARINGS, 30.0)[0]
        expected = model.expected_ranges(pose[None], Beams(BEARINGS, exact, np.zeros(3), 30.0))[0]
        errors.append(np.abs(expected - np.minimum(exact, 30.0)) / grid.resolution)
    near = np.concatenate(errors)
    assert np.median(near) < 0.5
    assert np.mean(near > 3.0) < 0.04


def test_a_cloud_too_large_for_the_cache_weighs_the_same() -> None:
    grid, rng = room(), np.random.default_rng(0)
    free_space = free_space_of(grid)
    model = beam_model_of(free_space)
    beams = Beams(BEARINGS[::40], np.full(len(BEARINGS[::40]), 2.0), BASE_FROM_LASER, 30.0)
    poses = free_space.draw_poses(30_000, rng)
    poses[::7] += 100.0
    in_parts = [model.log_likelihood(part, beams) for part in np.array_split(poses, 10)]
    np.testing.assert_array_equal(model.log_likelihood(poses, beams), np.concatenate(in_parts))
