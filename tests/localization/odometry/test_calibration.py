from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.config import OdometryCalibrationConfig, SegmentConfig
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.segments import OdometrySegments
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, compose

SLIP = 0.3


class Car:
    """Weaves about, with odometry that has faults of way, turn and trim."""

    def __init__(self, faults: tuple[float, float, float], effort: float = 0.0) -> None:
        self._effort = np.full(2, effort)
        self._way, self._turn, self._trim = faults
        self.calibration, self._segments = (
            OdometryCalibration(OdometryCalibrationConfig()),
            OdometrySegments(SegmentConfig()),
        )
        self._map_from_base: Pose = np.array([3.0, -1.0, 2.0])
        self._rng = np.random.default_rng(0)

    @property
    def faults(self) -> NDArray[np.float64]:
        return np.array(astuple(self.calibration.faults))

    def drive(self, metres: float, *, bend: float = 1.0, push: float = 0.0) -> "Car":
        """Bends of so many radians per metre; pushes shove the car aside once in a while."""
        for number in range(round(metres / 0.05)):
            x, turn = 0.05, 0.05 * bend * np.sin(0.1 * number)
            moved = np.array([(1 + self._way) * x, 0.0, (1 + self._turn) * turn + self._trim * x])
            self._map_from_base = compose(self._map_from_base, moved)
            if number % 500 == 499:
                self._map_from_base = self._map_from_base + push
            told = self.calibration.faults.corrected(np.array([x, 0.0, turn]))
            step = MotionStep(told, np.zeros(3), 0.1, 0.025, self._effort)
            seen = self._map_from_base + 0.01 * self._rng.standard_normal(3)
            estimate = PoseEstimate(0, seen, 1e-4 * np.eye(3), 1.0, 1000.0, 1000, False, 0.0)
            segment = self._segments.follow(step, 0.0, estimate)
            if segment is not None:
                self.calibration.learn(segment, SLIP)
        return self


def test_before_anything_is_seen_odometry_is_as_it_is() -> None:
    told = np.array([0.1, 0.02, -0.05])
    np.testing.assert_allclose(
        OdometryCalibration(OdometryCalibrationConfig()).faults.corrected(told), told, atol=1e-15
    )


@settings(max_examples=10)
@given(st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-0.08, 0.08)))
@example((0.1484375, -0.125, -0.046875))
def test_faults_are_learned_within_fifty_metres(faults: tuple[float, float, float]) -> None:
    error = np.abs(Car(faults).drive(50.0).faults - faults)
    # Four times the usual error; the filter itself expects 0.027, 0.032 and 0.018.
    assert (error < [0.02, 0.045, 0.02]).all()


def test_what_was_learned_fades_where_nothing_more_is_seen_of_it() -> None:
    car = Car((0.05, 0.1, 0.0)).drive(60.0)
    learned = car.faults[1]
    assert car.drive(300.0, bend=0.0).faults[1] < 0.5 * learned
    assert car.faults[0] == pytest.approx(0.05, abs=0.01)


def test_a_bump_teaches_little() -> None:
    faults = (0.05, 0.0, 0.02)
    np.testing.assert_allclose(Car(faults).drive(60.0, push=1.0).faults, faults, atol=0.03)


def test_way_that_pushed_tyres_lose_counts_less() -> None:
    calm, pushed = (Car((-0.2, 0.0, 0.0), effort=each).drive(5.0).faults[0] for each in (0.0, 1.0))
    assert calm < 1.4 * pushed < 0.0
