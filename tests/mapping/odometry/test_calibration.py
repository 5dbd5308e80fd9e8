"""Wheels are calibrated by the steps that scan matching measured."""

import numpy as np

from racecar.mapping.odometry.calibration import WheelCalibration, calibrate
from racecar.mapping.odometry.config import WheelCalibrationConfig


def test_wheels_are_calibrated_in_spite_of_slip() -> None:
    rng = np.random.default_rng(0)
    matched = np.column_stack(
        [rng.uniform(0.1, 0.3, 400), rng.normal(0, 0.003, 400), rng.normal(0, 0.1, 400)]
    )
    wheels = matched / [0.95, 0.95, 1.04] - [0.0, 0.0, 0.0]
    wheels[:, 2] -= 0.03 * wheels[:, 0]
    wheels[::10] *= 1.5
    result = calibrate(wheels, matched, WheelCalibrationConfig())
    assert abs(result.path_scale - 0.95) < 0.01
    corrected = result.correct(wheels)
    assert np.median(np.abs(corrected[:, 2] - matched[:, 2])) < 0.003


def test_few_steps_calibrate_nothing() -> None:
    config = WheelCalibrationConfig(min_steps=30, initial_sigma=0.07)
    steps = np.tile([0.3, 0.0, 0.1], (29, 1))
    unknown = calibrate(steps, 0.9 * steps, config)
    assert unknown == WheelCalibration.unknown(config)
    np.testing.assert_allclose(unknown.correct(steps), steps)
    np.testing.assert_allclose(np.diag(unknown.worth), 0.07**-2.0)
    assert calibrate(steps, 0.9 * steps, WheelCalibrationConfig(min_steps=29)) != unknown
