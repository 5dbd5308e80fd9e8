import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.start_poses import draw_about, draw_start, region_about
from racecar.localization.floor.free_space import ANYWHERE, FreeSpace, find_free_space
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose
from tests.localization.scenes import MIDDLE, furnished, hall, rectangle

CONFIG = LocalizationConfig(particles=2000, scattered_particles=3000)


def free_space() -> FreeSpace:
    return find_free_space(furnished(hall(), rectangle(hall(), MIDDLE, 1.0, 1.0, 0.3)))


def on_map(x: float, y: float, yaw: float) -> Pose:
    return compose(hall().map_from_grid, [x, y, yaw])


@settings(max_examples=30)
@given(st.floats(0.3, 9.7), st.floats(0.3, 7.7), st.floats(-3.1, 3.1), st.integers(0, 1000))
def test_a_start_is_on_free_space_only(x: float, y: float, yaw: float, seed: int) -> None:
    drawn = draw_start(on_map(x, y, yaw), None, free_space(), CONFIG, np.random.default_rng(seed))
    assert drawn.shape == (2000, 3)
    assert np.all(free_space().contains(drawn[:, :2]))


def test_a_start_is_spread_as_the_settings_say() -> None:
    pose = on_map(2.5, 4.0, 0.4)
    drawn = draw_about(pose, 20_000, CONFIG, np.random.default_rng(0))
    np.testing.assert_allclose(drawn.mean(axis=0), pose, atol=0.02)
    np.testing.assert_allclose(drawn.std(axis=0), [0.5, 0.5, 0.25], rtol=0.03)


@pytest.mark.parametrize(
    "root",
    [np.diag([0.1, 0.2, 0.05]), np.array([[0.1, 0.0, 0.0], [0.15, 0.05, 0.0], [0.0, 0.02, 0.1]])],
)
def test_a_start_is_spread_by_its_covariance(root: np.ndarray) -> None:
    pose = on_map(2.5, 4.0, 0.4)
    config = LocalizationConfig(particles=50_000)
    drawn = draw_start(pose, root @ root.T, free_space(), config, np.random.default_rng(0))
    np.testing.assert_allclose(np.cov(drawn.T), root @ root.T, atol=1e-3)


def test_a_covariance_may_say_nothing_of_an_axis() -> None:
    drawn = draw_start(
        on_map(2.5, 4.0, 0.4), np.diag([0.01, 0.0, 0.01]), free_space(), CONFIG, np.random.default_rng(0)
    )
    np.testing.assert_allclose(drawn[:, 1], on_map(2.5, 4.0, 0.4)[1], atol=1e-9)


@settings(max_examples=30)
@given(st.floats(0.5, 9.5), st.floats(0.5, 7.5), st.floats(0.8, 20.0))
def test_within_a_radius_it_may_be_anywhere(x: float, y: float, radius: float) -> None:
    point = on_map(x, y, 0.0)[:2]
    place = free_space().within(region_about(point, radius, free_space()))
    drawn = place.draw_poses(2000, np.random.default_rng(0))
    assert np.hypot(*(drawn[:, :2] - point).T).max() < radius + 0.2
    assert np.all(free_space().contains(drawn[:, :2]))


def test_where_no_car_can_stand_is_a_sentence() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(UserError, match="free space"):
        region_about(on_map(MIDDLE[0], MIDDLE[1], 0.0)[:2], 0.2, free_space())
    with pytest.raises(UserError, match="free space"):
        draw_start(on_map(MIDDLE[0], MIDDLE[1], 0.0), 1e-6 * np.eye(3), free_space(), CONFIG, rng)


def test_anywhere_is_all_of_the_map() -> None:
    drawn = free_space().within(ANYWHERE).draw_poses(50_000, np.random.default_rng(0))
    cells = np.unique(free_space().grid.cell_of(drawn[:, :2]), axis=0)
    assert len(cells) > 0.97 * free_space().cell_count
