"""Walls are distinguished from floors and ceilings."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.sensors.motion import upright

GENERATOR_SEED = 5


def upright_points(points: np.ndarray) -> np.ndarray:
    return upright.upright_points(points)


def plate(height: float) -> np.ndarray:
    """(N, 3) a floor or ceiling with the noise of a sensor."""
    generator = np.random.default_rng(GENERATOR_SEED)
    points = generator.uniform(-10.0, 10.0, (4000, 3))
    points[:, 2] = height + 0.02 * generator.standard_normal(len(points))
    return points


def wall(rows: int) -> np.ndarray:
    """(N, 3) at x = 12, 2.4 m high."""
    y, z = np.meshgrid(np.arange(-10.0, 10.0, 0.1), np.linspace(0.0, 2.4, rows))
    return np.column_stack([np.full(y.size, 12.0), y.ravel(), z.ravel()])


def test_floor_and_ceiling_go_and_the_wall_stays() -> None:
    kept = upright_points(np.concatenate([plate(0.0), wall(rows=9), plate(2.4)]))
    assert (kept[:, 0] == 12.0).all()
    assert len(kept) == 7 * 200  # all rows but the lowest, where a floor may meet it, and the highest


def test_floor_at_the_foot_of_the_wall_goes() -> None:
    foot = plate(0.0) + np.array([12.0 - 9.9, 0.0, 0.0])
    kept = upright_points(np.concatenate([foot, wall(rows=9)]))
    assert (kept[:, 2] > 0.1).all()
    assert len(kept) == 7 * 200


def test_nothing_comes_of_nothing() -> None:
    assert upright_points(np.empty((0, 3))).shape == (0, 3)


@given(st.integers(0, 2**32 - 1), st.integers(1, 300))
def test_order_does_not_matter_and_nothing_is_made_up(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    points = generator.uniform([-0.5, -0.5, 0.0], [0.5, 0.5, 4.0], (count, 3))
    kept = {tuple(point) for point in upright_points(points)}
    assert kept <= {tuple(point) for point in points}
    assert kept == {tuple(point) for point in upright_points(generator.permutation(points))}
