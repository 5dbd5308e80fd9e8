import numpy as np
from drives import BASE_FROM_LASER, BEARINGS, room

from localization.beam_model import BeamModel
from localization.beam_table import TRACKING, beam_probabilities
from localization.beams import Beams
from localization.free_space import find_free_space
from localization.range_table import build_range_table
from maps.ray_casting import cast_ray_fan
from maps.se2 import compose


def test_log_likelihoods_agree_with_the_product_over_exact_ranges() -> None:
    grid, rng = room(), np.random.default_rng(0)
    free_space = find_free_space(grid, 10**6)
    model = BeamModel(free_space, build_range_table(free_space, 50), 2.2)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    bearings = BEARINGS[::5]
    measured = cast_ray_fan(grid, compose(truth, BASE_FROM_LASER)[None], bearings, 30.0)[0]
    particles = truth + [0.5, 0.5, 0.3] * rng.standard_normal((400, 3))
    particles = particles[free_space.contains(compose(particles, BASE_FROM_LASER)[:, :2])]
    expected = cast_ray_fan(grid, compose(particles, BASE_FROM_LASER), bearings, 30.0)
    z, d = (np.minimum(np.rint(r / grid.resolution), 600).astype(int) for r in (measured, expected))
    exact = np.log(beam_probabilities(600, TRACKING)[z[None, :], d]).sum(axis=1) / 2.2
    fast = model.log_likelihood(particles, Beams(bearings, measured, BASE_FROM_LASER, 30.0))
    assert np.corrcoef(fast, exact)[0, 1] > 0.997
    assert np.mean(np.abs(fast - exact)) < 1.0


def test_particles_off_the_map_get_the_least() -> None:
    grid = room()
    free_space = find_free_space(grid, 10**6)
    model = BeamModel(free_space, build_range_table(free_space, 50), 2.2)
    inside = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    particles = np.array([inside, [1e6, 1e6, 0.0], compose(grid.map_from_grid, [-0.5, -0.5, 0.0])])
    beams = Beams(np.zeros(3), np.array([1.0, 2.0, np.inf]), BASE_FROM_LASER, 30.0)
    likelihood = model.log_likelihood(particles, beams)
    assert np.all(np.isfinite(likelihood))
    assert likelihood[0] > likelihood[1] == likelihood[2]
