import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose, wrap_angle
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.evaluation.evaluation import align, compare

SECOND = 1_000_000_000
poses = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1)).map(np.array)


def circle(count: int = 400) -> Trajectory:
    angle = np.linspace(0, 2 * np.pi, count)
    places = np.column_stack([3 * np.cos(angle), 3 * np.sin(angle), wrap_angle(angle + np.pi / 2)])
    return Trajectory(np.arange(count) * SECOND // 40, places)


@given(poses)
def test_alignment_undoes_any_motion(reference_from_map: np.ndarray) -> None:
    truth = circle()
    for rows in (slice(None), slice(0, 2), slice(0, 1)):  # the last did not move at all
        moved = compose(reference_from_map, truth.map_from_base[rows])
        found = align(truth.map_from_base[rows], moved)
        np.testing.assert_allclose(compose(found, truth.map_from_base[rows])[:, :2], moved[:, :2], atol=1e-9)
        np.testing.assert_allclose(wrap_angle(found[2] - reference_from_map[2]), 0, atol=1e-9)


def test_errors_after_alignment() -> None:
    truth = circle()
    estimated = truth.map_from_base.copy()
    # Errors that no rigid motion takes out: alternately inwards and outwards, heading too.
    sign = np.where(np.arange(len(truth)) % 2, 1.0, -1.0)
    estimated[:, :2] *= 1 + 0.02 / 3 * sign[:, None]
    estimated[:, 2] += np.deg2rad(0.5) * sign
    errors = compare(Trajectory(truth.stamps, compose([1, 2, 0.3], estimated)), truth)
    np.testing.assert_allclose(errors.positions, 0.02, atol=2e-4)
    np.testing.assert_allclose(np.rad2deg(errors.headings), 0.5, atol=0.02)
    summary = errors.summary()
    assert summary["absolute_position_m"]["mean"] == pytest.approx(0.02, abs=2e-4)
    assert summary["absolute_heading_deg"]["max"] == pytest.approx(0.5, abs=0.02)
    assert summary["matched_share"] == 1.0


def test_relative_error_sees_drift() -> None:
    truth = circle()
    drifting = truth.map_from_base.copy()
    drifting[:, :2] *= 1.05
    errors = compare(Trajectory(truth.stamps, drifting), truth)
    assert errors.relative_positions.mean() == pytest.approx(0.05, rel=0.05)
    assert errors.relative_headings.max() == pytest.approx(0.0, abs=1e-6)


def test_a_given_alignment_is_kept() -> None:
    truth = circle()
    shifted = Trajectory(truth.stamps, compose([0.1, 0, 0], truth.map_from_base))
    errors = compare(shifted, truth, reference_from_map=np.zeros(3))
    np.testing.assert_allclose(errors.positions, 0.1)


def test_reference_is_interpolated_but_not_over_gaps() -> None:
    truth = circle(4000)  # a step is 4.7 mm
    every_third = np.arange(0, 4000, 3)
    keep = (every_third < 1000) | (every_third > 1500)
    sparse = Trajectory(truth.stamps[every_third[keep]], truth.map_from_base[every_third[keep]])
    errors = compare(truth, sparse)
    assert errors.positions.max() < 1e-5
    assert errors.matched == np.sum((np.arange(4000) <= 999) | (np.arange(4000) >= 1503))
    assert errors.total == 4000


def test_sparse_reference_with_rounded_stamps_matches() -> None:
    truth = circle()
    seconds_apart = Trajectory(truth.stamps * 40 + 321, truth.map_from_base)
    rounded = Trajectory(truth.stamps * 40, truth.map_from_base)
    errors = compare(seconds_apart, rounded)
    assert errors.matched == len(truth)
    assert errors.positions.max() < 1e-5


def test_short_drives_have_no_relative_error() -> None:
    truth = circle()
    start = Trajectory(truth.stamps[:10], truth.map_from_base[:10])
    summary = compare(start, truth).summary()
    assert summary["relative_position_m_per_1m"] is None
    assert summary["absolute_position_m"]["max"] < 1e-9


def test_nothing_in_common() -> None:
    truth = circle()
    with pytest.raises(UserError, match="no time in common"):
        compare(truth, Trajectory(truth.stamps + 100 * SECOND, truth.map_from_base))
