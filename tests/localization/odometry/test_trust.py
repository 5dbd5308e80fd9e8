import numpy as np
import pytest

from racecar.localization.odometry.motion_model import MotionStep
from racecar.localization.odometry.segments import OdometrySegments
from racecar.localization.odometry.speed_memory import SpeedMemory
from racecar.localization.odometry.trust import OdometryTrust
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, compose

SLIP = 0.3
STEP = np.array([0.1, 0.0, 0.05])


def stepped(effort: float = 0.5) -> MotionStep:
    return MotionStep(STEP, np.zeros(3), 0.15, 0.05, effort=np.full(2, effort))


def estimate_at(map_from_base: Pose, deviation: float = 0.01) -> PoseEstimate:
    """Of which each coordinate may be off by so much."""
    return PoseEstimate(0, map_from_base, deviation**2 * np.eye(3), 1.0, 1000.0, 1000, False, 0.0)


class Car:
    """Its trust in its odometry, and where it is."""

    def __init__(self) -> None:
        self.trust, self._segments = OdometryTrust(), OdometrySegments()
        self.map_from_base: Pose = np.array([3.0, -1.0, 2.0])

    @property
    def slip_scale(self) -> float:
        return float(self.trust.slip_scale(SLIP).max())

    def drive(
        self,
        metres: float,
        wrong: float = 0.0,
        *,
        effort: float = 0.5,
        is_known: bool = True,
        deviation: float = 0.01,
    ) -> "Car":
        """Odometry overstates way and turn by a share of what was gone."""
        for _ in range(round(metres / STEP[0])):
            self.map_from_base = compose(self.map_from_base, STEP / (1.0 + wrong))
            estimate = estimate_at(self.map_from_base, deviation) if is_known else None
            self.follow(stepped(effort), 0.0, estimate)
        return self

    def weave(self, seconds: float, believed_lag: float) -> "Car":
        """Gas, brake and steering all the while, by a car that follows its odometry late."""
        memory, lag = SpeedMemory(), 1.5
        for moment in np.arange(0.0, seconds, 0.05):
            told = 0.05 * np.array([2.0 + np.sin(3.0 * moment), 0.0, 2.0 * np.sin(2.0 * moment)])
            possible, effort, behind = memory.take(told, 0.05)
            step = MotionStep(told, np.zeros(3), float(possible.sum()), 0.05, effort, behind)
            self.map_from_base = compose(self.map_from_base, told + lag * behind)
            self.follow(step, believed_lag, estimate_at(self.map_from_base))
        return self

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None) -> None:
        segment = self._segments.follow(step, lag, estimate)
        if segment is not None:
            self.trust.learn(segment, SLIP)

    def put_elsewhere(self) -> "Car":
        self.map_from_base = np.array([20.0, 20.0, 1.0])
        return self


def test_before_anything_is_seen_the_settings_are_believed() -> None:
    assert Car().slip_scale == pytest.approx(1.0)


def test_odometry_that_proves_right_is_trusted_more_and_more() -> None:
    car = Car()
    scales = [car.drive(10.0).slip_scale for _ in range(4)]
    assert scales == sorted(scales, reverse=True)
    assert scales[-1] < 0.3


@pytest.mark.parametrize("slip", [0.08, 0.15, 0.25])
def test_the_slip_scale_comes_to_what_the_tyres_slip(slip: float) -> None:
    effort = 0.8
    car = Car().drive(60.0, slip * effort, effort=effort)
    assert car.slip_scale == pytest.approx(slip / SLIP, rel=0.35)


def test_odometry_is_never_trusted_less_than_the_settings_say() -> None:
    assert Car().drive(30.0, 1.5).slip_scale == 1.0


def test_trust_is_lost_in_metres_and_regained_in_tens_of_them() -> None:
    car = Car().drive(40.0)
    trusted = car.slip_scale
    assert car.drive(6.0, 0.5).slip_scale > 0.6
    assert car.drive(100.0).slip_scale < 1.3 * trusted


def test_one_bump_does_not_cost_the_trust() -> None:
    car = Car().drive(40.0)
    trusted = car.slip_scale
    assert trusted < car.put_elsewhere().drive(2.0).slip_scale < 0.5


def test_where_the_place_is_not_known_nothing_is_learned() -> None:
    car = Car().drive(40.0)
    trusted = car.slip_scale
    assert car.drive(40.0, 0.4, is_known=False).slip_scale == trusted


def test_odometry_that_comes_early_is_trusted_all_the_same() -> None:
    as_it_is = Car().weave(30.0, believed_lag=1.5).slip_scale
    assert as_it_is < 0.3
    assert Car().weave(30.0, believed_lag=0.0).slip_scale > 2.0 * as_it_is


def test_what_the_estimates_leave_open_is_not_held_against_odometry() -> None:
    scales = [Car().drive(40.0, 0.08, deviation=each).slip_scale for each in (0.01, 0.03, 0.1)]
    assert scales == sorted(scales, reverse=True)
    assert scales[-1] < 0.5 * scales[0]


def test_tyres_that_cannot_slip_are_trusted() -> None:
    assert OdometryTrust().slip_scale(0.0).tolist() == [0.0, 0.0]
