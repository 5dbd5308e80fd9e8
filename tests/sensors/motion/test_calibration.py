"""Wheels are calibrated by what scan matching measured over spans of steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.motion import calibration
from racecar.sensors.motion.calibration import MatchedSpans, WheelCalibration, calibrate

LENGTHS = (1, 2, 4, 7, 11, 16)


def drive(rng: np.random.Generator, count: int) -> Pose:
    """(N, 3) steps that a car truly took."""
    return np.column_stack(
        [rng.uniform(0.1, 0.3, count), rng.normal(0, 0.003, count), rng.normal(0, 0.1, count)]
    )


def matched(
    true: Pose, rng: np.random.Generator, bias: float = 0.0, sigma: float = 0.002, observes: bool = True
) -> MatchedSpans:
    """What scan matching measures of true steps (N, 3); each match turns by a ``bias`` too far."""
    places = [IDENTITY]
    for step in true:
        places.append(compose(places[-1], step))
    chain = np.array(places)
    ends = [(k, k + length) for length in LENGTHS for k in range(len(true) + 1 - length)]
    first, end = np.array(ends).T
    motions = between(chain[first], chain[end]) + rng.normal(0, sigma, (len(first), 3))
    motions[:, 2] += bias
    information = np.diag([1e4 if observes else 1e-3, 1e4, 1e5])
    return MatchedSpans(first, end, motions, np.tile(information, (len(first), 1, 1)))


def wheels_of(true: Pose, per_metre: float, turn_scale: float, path_scale: float) -> Pose:
    """The steps as wheels with these faults report them."""
    wheels = true / [path_scale, path_scale, turn_scale]
    wheels[:, 2] -= per_metre * np.hypot(wheels[:, 0], wheels[:, 1]) / turn_scale
    return wheels


@settings(max_examples=20)
@given(st.floats(-0.03, 0.03), st.floats(0.95, 1.05), st.floats(0.95, 1.05))
def test_faults_are_found_in_spite_of_slip(per_metre: float, turn_scale: float, path_scale: float) -> None:
    rng = np.random.default_rng(0)
    true = drive(rng, 300)
    wheels = wheels_of(true, per_metre, turn_scale, path_scale)
    wheels[::40] *= 1.5
    result = calibrate(wheels, matched(true, rng))
    assert abs(result.faults.distance - (path_scale - 1.0)) < 0.01
    assert abs(result.faults.trim - per_metre) < 0.002
    assert np.median(np.abs(result.faults.corrected(wheels)[:, 2] - true[:, 2])) < 0.003


@settings(max_examples=10)
@given(st.integers(0, 1000), st.floats(-0.01, 0.01))
def test_noise_on_straights_is_no_wrong_gain_of_turns(seed: int, per_metre: float) -> None:
    rng = np.random.default_rng(seed)
    true = drive(rng, 300) * [1.0, 1.0, 0.01]
    wheels = wheels_of(true, per_metre, 1.0, 1.0)
    wheels[:, 2] += rng.normal(0.0, 0.003, len(wheels))
    result = calibrate(wheels, matched(true, rng))
    assert abs(result.faults.turn) < 0.15
    assert abs(result.faults.trim - per_metre) < 0.004


def test_a_factor_that_no_wheels_have_is_not_corrected() -> None:
    rng = np.random.default_rng(8)
    true = drive(rng, 300)
    spans = matched(true, rng)
    twice = calibrate(wheels_of(true, 0.0, 1.0, 2.0), spans)
    assert abs(twice.faults.distance - 1.0) < 0.01
    assert calibrate(wheels_of(true, 0.0, 1.0, 5.0), spans).faults.distance == 0.0


def test_a_bias_of_each_match_is_no_fault_of_the_wheels() -> None:
    rng = np.random.default_rng(1)
    true = drive(rng, 300)
    result = calibrate(true, matched(true, rng, bias=0.003))
    assert abs(result.faults.trim) < 0.0005


def test_errors_of_matches_do_not_count_as_those_of_the_wheels(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    true = drive(rng, 300)
    monkeypatch.setattr(calibration, "_SIGMAS", (0.001, 0.3))
    result = calibrate(true, matched(true, rng, sigma=0.01))
    assert result.sigma_turn < 0.003
    slipping = true + rng.normal(0, 0.02, true.shape)
    result = calibrate(slipping, matched(true, rng, sigma=0.01))
    assert 0.012 < result.sigma_turn < 0.03
    assert 0.012 < result.sigma_distance < 0.03


def test_where_scans_do_not_observe_distances_the_path_is_left_as_it_is() -> None:
    rng = np.random.default_rng(3)
    true = drive(rng, 300)
    spans = matched(true, rng, observes=False)
    result = calibrate(wheels_of(true, 0.0, 1.0, 0.9), spans)
    assert abs(result.faults.distance) < 0.01
    assert abs(result.sigma_distance - calibration._INITIAL_SIGMA) < 0.005


def test_matches_that_tell_little_each_tell_the_path_together() -> None:
    rng = np.random.default_rng(6)
    true = drive(rng, 300)
    spans = matched(true, rng)
    little = np.tile(np.diag([0.3**-2, 1e4, 1e5]), (len(spans.first), 1, 1))
    motions = spans.motions + np.column_stack([rng.normal(0.0, 0.3, len(little)), np.zeros((len(little), 2))])
    poor = MatchedSpans(spans.first, spans.end, motions, little)
    result = calibrate(wheels_of(true, 0.0, 1.0, 0.9), poor)
    assert abs(result.faults.distance + 0.1) < 0.02


def test_steps_that_no_wheels_measured_are_left_out() -> None:
    rng = np.random.default_rng(4)
    true = drive(rng, 300)
    wheels = wheels_of(true, 0.0, 1.0, 0.97)
    wheels[100:110] = np.nan
    assert abs(calibrate(wheels, matched(true, rng)).faults.distance + 0.03) < 0.01


def test_few_steps_calibrate_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    true = drive(rng, 20)
    assert calibrate(1.1 * true, matched(true, rng)) != WheelCalibration()
    monkeypatch.setattr(calibration, "_MIN_SPANS", 1000)
    unknown = calibrate(1.1 * true, matched(true, rng))
    assert unknown == WheelCalibration()
    np.testing.assert_allclose(unknown.faults.corrected(true), true)
    np.testing.assert_allclose(np.diag(unknown.prior(IDENTITY)), 0.05**-2.0)


def variances(known: WheelCalibration, metres: float) -> NDArray[np.float64]:
    return np.diag(np.linalg.inv(known.information(np.array([metres, 0.0, 0.0]))))


def test_errors_of_a_long_step_add_up() -> None:
    known = WheelCalibration(usual_step=0.25)
    np.testing.assert_allclose(variances(known, 1.0), 4.0 * variances(known, 0.25))
    np.testing.assert_allclose(variances(known, 0.1), variances(known, 0.25))
