"""Branch and bound returns what trying every place would."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.sensors.matching import correlative_search
from racecar.sensors.matching.correlative_search import ANGLE_STEP, CELL, LikelihoodPyramid, Window, search


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_equals_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fixed = rng.uniform(-4, 4, (120, 2))
    moving = rng.uniform(-3, 3, (30, 2))
    pyramid = LikelihoodPyramid(fixed, 10.0)
    window = Window(0.8, 3 * ANGLE_STEP)
    fit = search(pyramid, moving, np.zeros(3), window, 0.01, 0.99)
    best = 0.0
    level = pyramid.levels[0].astype(float) / 255.0
    for turn in np.arange(-3, 4) * ANGLE_STEP:
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        cells = pyramid.cells_of(moving @ rotation.T)
        for dr in range(-8, 9):
            for dc in range(-8, 9):
                at = cells + np.array([dr, dc])
                inside = np.all((at >= 0) & (at < level.shape), axis=1)
                best = max(best, level[at[inside, 0], at[inside, 1]].sum() / len(moving))
    assert fit is not None
    assert abs(fit.score - best) < 1e-6


def test_finds_a_moved_copy_and_no_rival() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-8, 8, (300, 2))
    yaw = 0.2
    rotation = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    fixed = points @ rotation.T + [2.3, -1.7]
    fit = search(LikelihoodPyramid(fixed, 20.0), points, np.zeros(3), Window(4.0, 0.4), 0.5, 0.85)
    assert fit is not None
    assert np.hypot(fit.pose[0] - 2.3, fit.pose[1] + 1.7) < 2 * CELL
    assert abs(fit.pose[2] - yaw) < 2 * ANGLE_STEP
    assert fit.runner_up == 0.0


@pytest.mark.parametrize(
    ("apart", "share", "has_rival"), [(None, (0.85,), True), (None, (), False), ((80, 13), (0.85,), False)]
)
def test_along_a_corridor_there_is_a_rival_if_it_is_asked_for_and_far_enough_off(
    apart: tuple[int, int] | None, share: tuple[float], has_rival: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if apart is not None:
        monkeypatch.setattr(correlative_search, "_APART", apart)
    x = np.arange(-10, 10, 0.1)
    walls = np.concatenate([np.column_stack([x, np.full_like(x, y)]) for y in (-1.0, 1.0)])
    asked = LikelihoodPyramid(walls, 20.0), walls[50:150], np.zeros(3), Window(3.0, 0.1), 0.5
    fit, alone = search(*asked, *share), search(*asked)
    assert fit is not None and alone is not None
    assert fit.runner_up > 0.85 if has_rival else fit.runner_up == 0.0
    assert np.array_equal(alone.pose, fit.pose)
