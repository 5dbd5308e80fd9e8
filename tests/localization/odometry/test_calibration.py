from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from racecar.localization.odometry.calibration import OdometryCalibration
from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.segments import OdometrySegment, OdometrySegments
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.scan import Scan

SLIP = 0.3


class Car:
    """Weaves about, with odometry that has faults of way, turn and trim."""

    def __init__(
        self,
        faults: tuple[float, float, float],
        effort: float = 0.0,
        *,
        laser_turn: float = 0.0,
        side_slip: float = 0.0,
    ) -> None:
        self._effort = np.full(2, effort)
        self._way, self._turn, self._trim = faults
        self._turned, self._side_slip = laser_turn, side_slip
        """By how much the laser is still turned, once scans are corrected by what was learned."""
        self.calibration, self._segments = (
            OdometryCalibration(),
            OdometrySegments(),
        )
        self._map_from_base: Pose = np.array([3.0, -1.0, 2.0])
        self._rng = np.random.default_rng(0)

    @property
    def faults(self) -> NDArray[np.float64]:
        return np.array(astuple(self.calibration.faults))

    def drive(self, metres: float, *, bend: float = 1.0, push: float = 0.0) -> "Car":
        """Bends of so many radians per metre; pushes shove the car aside once in a while."""
        learned = self.calibration.laser_turn
        for number in range(round(metres / 0.05)):
            x, turn = 0.05, 0.05 * bend * np.sin(0.1 * number)
            aside = np.copysign(self._effort[1], turn) * self._side_slip * x
            moved = np.array([(1 + self._way) * x, aside, (1 + self._turn) * turn + self._trim * x])
            self._map_from_base = compose(self._map_from_base, moved)
            if number % 500 == 499:
                self._map_from_base = self._map_from_base + push
            told = self.calibration.faults.corrected(np.array([x, 0.0, turn]))
            corrected = self.calibration.laser_turn - learned
            told[2] -= corrected
            self._turned, learned = self._turned - corrected, self.calibration.laser_turn
            step = MotionStep(told, np.zeros(3), 0.1, 0.025, self._effort)
            seen = self._map_from_base + 0.01 * self._rng.standard_normal(3) + [0.0, 0.0, self._turned]
            estimate = PoseEstimate(0, seen, 1e-4 * np.eye(3), 1.0, 1000.0, 1000, False, 0.0)
            segment = self._segments.follow(step, 0.0, estimate)
            if segment is not None:
                self.calibration.learn(segment, SLIP)
        return self


@settings(max_examples=10)
@given(st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-0.08, 0.08)))
@example((0.1484375, -0.125, -0.046875))
@example((0.125, -0.078125, -0.046875))
def test_faults_are_learned_within_fifty_metres(faults: tuple[float, float, float]) -> None:
    error = np.abs(Car(faults).drive(50.0).faults - faults)
    # Up to four times the usual error; the filter itself expects 0.027, 0.032 and 0.018.
    assert (error < [0.03, 0.045, 0.02]).all()


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


@pytest.mark.parametrize(("share", "is_told"), [(0.0, False), (0.2, False), (0.5, True), (1.0, True)])
def test_odometry_that_suddenly_tells_half_is_told(share: float, is_told: bool) -> None:
    calibration = Car((0.03, 0.0, 0.0)).drive(30.0).calibration
    assert calibration.odometry_warning is None
    error = np.array([share, 0.0, 0.0])
    metre = OdometrySegment(error, np.zeros((3, 5)), 1e-4 * np.eye(3), np.array([1.0, 0.0]), np.zeros(2))
    for _ in range(3):
        calibration.learn(metre, SLIP)
    assert (calibration.odometry_warning is not None) == is_told
    assert not is_told or "For at least 3 m" in str(calibration.odometry_warning)
    assert calibration.faults.distance == pytest.approx(0.03, abs=0.01)


@pytest.mark.parametrize("laser_turn", [-0.07, -0.035, 0.035])
def test_a_turned_laser_shows_and_is_told(laser_turn: float) -> None:
    calibration = Car((0.03, 0.0, 0.02), laser_turn=laser_turn).drive(30.0).calibration
    assert calibration.laser_turn == pytest.approx(laser_turn, abs=0.008)
    assert calibration.laser_warning is not None
    assert ("left" if laser_turn > 0.0 else "right") in calibration.laser_warning
    assert calibration.faults.trim == pytest.approx(0.02, abs=0.015)


@pytest.mark.parametrize(("trim", "side_slip"), [(0.0, 0.0), (0.05, 0.0), (0.0, 0.1), (0.0, -0.1)])
def test_neither_trim_nor_slip_in_bends_passes_for_a_turned_laser(trim: float, side_slip: float) -> None:
    calibration = Car((0.0, 0.0, trim), 0.6, side_slip=side_slip).drive(100.0).calibration
    assert calibration.laser_turn == 0.0
    assert calibration.laser_warning is None


def test_faults_are_bounded() -> None:
    assert np.abs(Car((1.5, 0.0, 0.0)).drive(100.0).faults[0]) <= 0.4


def test_what_was_learned_of_the_laser_is_forgotten_where_it_is_told_elsewhere() -> None:
    calibration = Car((0.0, 0.0, 0.0), laser_turn=0.05).drive(20.0).calibration
    told = np.array([0.2, 0.0, 0.0])
    scan = Scan(0, np.zeros(1), np.ones(1), np.zeros(1), told, 10.0)
    assert calibration.turned(scan).base_from_laser[2] == calibration.laser_turn != 0.0
    elsewhere = replace(scan, base_from_laser=told + np.array([0.0, 0.0, 0.05]))
    assert calibration.turned(elsewhere) is elsewhere
    assert calibration.laser_warning is None
