import numpy as np
import pytest

from localization.motion_step import MotionStep
from localization.odometry_trust import OdometryTrust
from maps.se2 import IDENTITY, Pose, compose

SLIP = 0.3
STEP = np.array([0.1, 0.0, 0.05])


def stepped(effort: float = 0.5) -> MotionStep:
    return MotionStep(STEP, np.zeros(3), 0.15, 0.05, effort=np.full(2, effort))


START, ELSEWHERE = np.array([3.0, -1.0, 2.0]), np.array([20.0, 20.0, 1.0])


def drive(
    trust: OdometryTrust,
    metres: float,
    wrong: float,
    *,
    effort: float = 0.5,
    is_known: bool = True,
    map_from_odom: Pose = START,
) -> OdometryTrust:
    """Odometry overstates way and turn by a share of what was gone."""
    odom_from_base: Pose = IDENTITY
    map_from_base: Pose = map_from_odom
    for _ in range(round(metres / STEP[0])):
        odom_from_base = compose(odom_from_base, STEP)
        map_from_base = compose(map_from_base, STEP / (1.0 + wrong))
        trust.follow(stepped(effort), odom_from_base, map_from_base if is_known else None, SLIP)
    return trust


def test_before_anything_is_seen_the_settings_are_believed() -> None:
    assert OdometryTrust().doubt(SLIP) == pytest.approx(1.0)


def test_odometry_that_proves_right_is_doubted_less_and_less() -> None:
    trust = OdometryTrust()
    doubts = [drive(trust, 10.0, 0.0).doubt(SLIP) for _ in range(4)]
    assert doubts == sorted(doubts, reverse=True)
    assert doubts[-1] < 0.3


@pytest.mark.parametrize("slip", [0.08, 0.15, 0.25])
def test_the_doubt_comes_to_what_the_tyres_slip(slip: float) -> None:
    effort = 0.8
    trust = drive(OdometryTrust(), 60.0, slip * effort, effort=effort)
    assert trust.doubt(SLIP) == pytest.approx(slip / SLIP, rel=0.35)


def test_odometry_is_never_doubted_more_than_the_settings_say() -> None:
    assert drive(OdometryTrust(), 30.0, 1.5).doubt(SLIP) == 1.0


def test_trust_is_lost_in_metres_and_regained_in_tens_of_them() -> None:
    trust = drive(OdometryTrust(), 40.0, 0.0)
    trusted = trust.doubt(SLIP)
    drive(trust, 6.0, 0.5)
    assert trust.doubt(SLIP) > 0.6
    drive(trust, 100.0, 0.0)
    assert trust.doubt(SLIP) < 1.3 * trusted


def test_one_bump_does_not_cost_the_trust() -> None:
    trust = drive(OdometryTrust(), 40.0, 0.0)
    trusted = trust.doubt(SLIP)
    drive(trust, 2.0, 0.0, map_from_odom=ELSEWHERE)
    assert trusted < trust.doubt(SLIP) < 0.5


def test_where_the_place_is_not_known_nothing_is_learned() -> None:
    trust = drive(OdometryTrust(), 40.0, 0.0)
    trusted = trust.doubt(SLIP)
    assert drive(trust, 40.0, 0.4, is_known=False).doubt(SLIP) == trusted


def test_a_car_found_elsewhere_was_not_carried_there_by_its_wheels() -> None:
    trust = drive(OdometryTrust(), 40.0, 0.0)
    trusted = trust.doubt(SLIP)
    trust.start_anew()
    assert drive(trust, 3.0, 0.0, map_from_odom=ELSEWHERE).doubt(SLIP) < trusted


@pytest.mark.parametrize("odom_from_base", [None, IDENTITY])
def test_a_stretch_ends_where_nothing_measures_the_way(odom_from_base: Pose | None) -> None:
    trust = drive(OdometryTrust(), 40.0, 0.0)
    trusted = trust.doubt(SLIP)
    unmeasured = MotionStep(STEP, np.zeros(3), np.inf if odom_from_base is not None else 0.15, 0.05)
    trust.follow(unmeasured, odom_from_base, START, SLIP)
    assert drive(trust, 3.0, 0.0, map_from_odom=ELSEWHERE).doubt(SLIP) < trusted


def test_tyres_that_cannot_slip_are_not_doubted() -> None:
    assert OdometryTrust().doubt(0.0) == 0.0
