"""Scan matching finds the pose between two scans of a room, and invents none along a corridor."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import between
from racecar.sensors.matching.match_information import as_prior, match_information
from racecar.sensors.matching.scan_matching import match, one_to_one
from racecar.sensors.matching.scan_matching_kernels import (
    NORMAL_VARIANCE,
    TABLE_SIZE,
    fill_bearing_table,
    first_by_bearing,
    nearest_from,
    remove_sliding,
)
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan
from tests.sensors.worlds import CORRIDOR, box, outline, store_of

ROOM = np.concatenate([box(-3, -2, 4, 3), outline((1, -2), (1, -1))])
ONE_PAIR = one_to_one(np.array([[0, 1]]))


@settings(max_examples=40)
@given(
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
    st.floats(-0.25, 0.25),
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
)
def test_finds_the_pose_in_a_room(x: float, y: float, yaw: float, off_x: float, off_yaw: float) -> None:
    first, second = np.array([0.0, 0.3, 0.2]), np.array([x, y, 0.2 + yaw])
    store = store_of(ROOM, np.array([first, second]))
    true = between(first, second)
    result = match((true + np.array([off_x, 0.05, off_yaw]))[None], ONE_PAIR, store, store)
    error = between(true, result.poses[0])
    assert np.hypot(error[0], error[1]) < 0.03
    assert abs(error[2]) < 0.01
    assert result.overlap[0] > 0.5


def test_knows_nothing_along_a_bare_corridor() -> None:
    store = store_of(CORRIDOR, np.array([[0.0, 0.0, 0.0], [0.4, 0.1, 0.05]]))
    guess = np.array([0.25, 0.05, 0.0])
    result = match(guess[None], ONE_PAIR, store, store)
    along = result.hessians[0][0, 0] / result.hessians[0][1, 1]
    assert along < 0.02
    assert abs(result.poses[0][1] - 0.1) < 0.02
    assert abs(result.poses[0][2] - 0.05) < 0.01


@given(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), st.floats(0.0, 2000.0))
def test_what_noisy_normals_pretend_is_taken_out_of_the_direction_of_least_information(
    numbers: list[float], weight: float
) -> None:
    root = np.reshape(numbers, (3, 3))
    hessian = root @ root.T + 0.1 * np.eye(3)
    gradient = root[0].copy()
    (small, large), axes = np.linalg.eigh(hessian[:2, :2])
    assume(large - small > 0.01)
    shrink = np.sqrt(max(small - NORMAL_VARIANCE * weight, 0.0) / small)
    along = np.array([*axes[:, 0], 0.0])
    projection = np.eye(3) - (1.0 - shrink) * np.outer(along, along)
    expected = projection @ hessian @ projection, projection @ gradient
    remove_sliding(hessian, gradient, weight)
    np.testing.assert_allclose(hessian, expected[0], atol=1e-9)
    np.testing.assert_allclose(gradient, expected[1], atol=1e-9)


def test_scans_without_points_leave_the_guess() -> None:
    store = ScanStore(2)
    for _ in range(2):
        store.add(prepare_scan(np.zeros((0, 2))))
    guess = np.array([[0.1, 0.2, 0.3]])
    result = match(guess, ONE_PAIR, store, store)
    assert np.allclose(result.poses, guess)
    assert result.overlap[0] == 0.0


HALF_VIEW = np.deg2rad(135.0)
RETURNS = st.tuples(st.floats(-HALF_VIEW, HALF_VIEW), st.floats(0.05, 8.0))


def scan_of(returns: list[tuple[float, float]]) -> np.ndarray:
    bearings, ranges = np.array(sorted(returns)).T
    return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)]).astype(np.float32)


@settings(max_examples=300)
@given(st.lists(RETURNS, min_size=1, max_size=60), RETURNS, st.floats(0.05, 1.0), st.data())
def test_the_nearest_point_is_found_from_wherever_in_half_a_turn_the_search_starts(
    returns: list[tuple[float, float]], seen: tuple[float, float], reach: float, data: st.DataObject
) -> None:
    points = scan_of(returns)
    ((x, y),) = scan_of([seen]).astype(np.float64)
    turns = np.abs(np.arctan2(points[:, 1], points[:, 0]) - np.arctan2(y, x))
    assume(turns.min() < 3.1)
    start = data.draw(st.sampled_from(np.flatnonzero(turns < 3.1).tolist()))
    squared = np.sum((points.astype(np.float64) - [x, y]) ** 2, axis=1)
    assume(abs(squared.min() - reach * reach) > 1e-9)
    best, best_squared = nearest_from(start, x, y, points, len(points), reach)
    if squared.min() < reach * reach:
        np.testing.assert_allclose([squared[best], best_squared], squared.min())
    else:
        assert (best, best_squared) == (-1, reach * reach)


@given(st.lists(RETURNS, min_size=1, max_size=60), RETURNS)
def test_the_table_leads_to_a_like_bearing(
    returns: list[tuple[float, float]], seen: tuple[float, float]
) -> None:
    points, table = scan_of(returns), np.zeros(TABLE_SIZE + 1, dtype=np.int16)
    fill_bearing_table(points, table)
    ((x, y),) = scan_of([seen]).astype(np.float64)
    bearings, bearing = np.arctan2(points[:, 1], points[:, 0]), np.arctan2(y, x)
    index, bin_width = first_by_bearing(x, y, table), 2.0 * np.pi / TABLE_SIZE
    assert np.all(bearings[:index] < bearing + 1e-6)
    assert np.all(bearings[index:] > bearing - 1.001 * bin_width)


HESSIAN = np.diag([30.0, 20.0, 400.0])


@pytest.mark.parametrize("residual", [0.0, 0.005, 0.02, 0.03])
def test_a_prior_as_good_as_a_match_weighs_as_much(residual: float) -> None:
    """But for what keeps information from being singular."""
    prior = as_prior(match_information(HESSIAN, residual), residual)
    np.testing.assert_allclose(prior, HESSIAN, atol=1e-4)


def test_a_poor_match_tells_less() -> None:
    clean, noisy = match_information(HESSIAN, 0.0), match_information(HESSIAN, 0.02)
    np.testing.assert_allclose(noisy[0, 0], clean[0, 0] / 4.0, rtol=1e-2)
