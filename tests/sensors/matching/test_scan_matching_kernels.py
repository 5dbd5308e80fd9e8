"""The nearest point of a scan is found without looking at all of them."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from racecar.sensors.matching.scan_matching_kernels import (
    TABLE_SIZE,
    fill_bearing_table,
    first_by_bearing,
    nearest_from,
)

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
