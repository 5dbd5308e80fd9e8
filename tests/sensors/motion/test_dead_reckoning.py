"""What wheels, scans and the last velocity say about the motion since the last keyframe."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.matching.scan_store import prepare_scan
from racecar.sensors.motion.dead_reckoning import DeadReckoning
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.odometry import Odometry
from tests.sensors.worlds import ROOM, points_at, scan_at

PERIOD = 100_000_000
PLACE = np.array([0.27, 0.05, 0.1])
START = np.array([-2.0, -0.5, 0.1])
poses = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-np.pi, np.pi)).map(np.array)
SEEN = prepare_scan(points_at(ROOM, compose(START, PLACE)))
steps = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.02, 0.02), st.floats(-0.15, 0.15)).map(np.array)


def drive(
    step: Pose, count: int, *, odom_from_map: Pose | None = IDENTITY, known_from: int = 0
) -> DeadReckoning:
    """The first scan is the keyframe; ``count`` more follow, the base a ``step`` (3,) further at each."""
    reckoning = DeadReckoning()
    map_from_base = START
    for number in range(count + 1):
        stamp = number * PERIOD
        if odom_from_map is not None:
            reckoning.add_odometry(Odometry(stamp, compose(odom_from_map, map_from_base), IDENTITY))
        known = PLACE if number >= known_from else IDENTITY
        reckoning.advance(scan_at(ROOM, compose(map_from_base, PLACE), stamp, known))
        if number == 0:
            reckoning.start_keyframe(IDENTITY, SEEN)
        map_from_base = compose(map_from_base, step)
    return reckoning


def laser_step(step: Pose, count: int) -> Pose:
    """keyframe_from_laser (3,) after ``count`` steps (3,) of the base."""
    return between(compose(START, PLACE), compose(base_after(step, count), PLACE))


def base_after(step: Pose, count: int) -> Pose:
    """map_from_base (3,) after ``count`` steps (3,)."""
    map_from_base = START
    for _ in range(count):
        map_from_base = compose(map_from_base, step)
    return map_from_base


@settings(max_examples=15)
@given(steps, poses)
def test_wheels_and_scans_report_the_motion_of_the_laser(step: Pose, odom_from_map: Pose) -> None:
    """Wherever the odometry frame lies."""
    by_wheels, by_scans, _ = drive(step, 3, odom_from_map=odom_from_map).guesses().motions
    expected = laser_step(step, 3)
    np.testing.assert_allclose(by_wheels, expected, atol=1e-9)
    np.testing.assert_allclose(by_scans, expected, atol=0.05)


@pytest.mark.parametrize("known_from", [1, 2, 3])
def test_the_mount_of_the_laser_may_become_known_late(known_from: int) -> None:
    step = np.array([0.1, 0.0, 0.05])
    reckoning = drive(step, 3, known_from=known_from)
    np.testing.assert_allclose(reckoning.wheel_step(), laser_step(step, 3), atol=1e-9)
    np.testing.assert_array_equal(reckoning.mounts.base_from_reference, PLACE)


def test_wheels_are_trusted_first_and_corrected() -> None:
    reckoning = drive(np.array([0.1, 0.0, 0.02]), 3)
    measured = reckoning.wheel_step()
    reckoning.calibration = replace(reckoning.calibration, faults=OdometryFaults(-0.1, 0.1, 0.1))
    assert not np.allclose(reckoning.calibration.faults.corrected(measured), measured, atol=0.01)
    np.testing.assert_allclose(
        reckoning.guesses().motions[0], reckoning.calibration.faults.corrected(measured)
    )
    np.testing.assert_allclose(reckoning.wheel_step(), measured)


@settings(max_examples=10)
@given(steps, st.integers(1, 4))
def test_the_last_guess_keeps_the_velocity_of_the_last_keyframe_step(step: Pose, later: int) -> None:
    """Whatever the sensors say."""
    reckoning = drive(IDENTITY, 2)
    reckoning.start_keyframe(step, SEEN)
    for number in range(3, 3 + later):
        reckoning.advance(scan_at(ROOM, compose(START, PLACE), number * PERIOD, PLACE))
    np.testing.assert_allclose(reckoning.guesses().motions[-1], step * later / 2, atol=1e-9)


def test_a_keyframe_resets_the_motion() -> None:
    reckoning = drive(np.array([0.1, 0.0, 0.02]), 3)
    reckoning.start_keyframe(laser_step(np.array([0.1, 0.0, 0.02]), 3), SEEN)
    np.testing.assert_allclose(reckoning.guesses().motions, np.zeros((3, 3)), atol=1e-12)


def test_without_odometry_scans_come_first_and_it_is_counted() -> None:
    step = np.array([0.1, 0.0, 0.02])
    reckoning = drive(step, 3, odom_from_map=None)
    assert reckoning.wheel_step() is None
    assert len(reckoning.guesses().motions) == 2
    np.testing.assert_allclose(reckoning.guesses().motions[0], laser_step(step, 3), atol=0.05)
    assert reckoning.scans_without_odometry == 4


@pytest.mark.parametrize(("late", "is_known"), [(0.4, True), (0.6, False)])
def test_odometry_that_has_stopped_is_not_taken_for_standing_still(late: float, is_known: bool) -> None:
    reckoning = drive(np.array([0.1, 0.0, 0.0]), 2)
    reckoning.advance(scan_at(ROOM, compose(START, PLACE), 2 * PERIOD + round(late * 1e9), PLACE))
    assert (reckoning.wheel_step() is not None) == is_known
    assert reckoning.scans_without_odometry == (not is_known)


@pytest.mark.parametrize(
    ("pause", "waited", "is_known"), [(0.9, 0.4, True), (1.5, 0.7, False), (1.5, 1.45, True)]
)
def test_a_pause_of_the_odometry_is_not_taken_for_straight_motion(
    pause: float, waited: float, is_known: bool
) -> None:
    """Odometry that comes again covers scans that waited for it."""
    reckoning = drive(np.array([0.1, 0.0, 0.0]), 2)
    last, comes_again = 2 * PERIOD, 2 * PERIOD + round(pause * 1e9)
    reckoning.add_odometry(Odometry(comes_again, base_after(np.array([0.1, 0.1, 1.0]), 2), IDENTITY))
    reckoning.advance(scan_at(ROOM, compose(START, PLACE), last + round(waited * 1e9), PLACE))
    assert (reckoning.wheel_step() is not None) == is_known
    assert reckoning.scans_without_odometry == (not is_known)


def test_over_a_jump_of_the_odometry_scans_report_the_motion_until_the_next_keyframe() -> None:
    """Its driver was restarted and counts from zero."""
    step = np.array([0.1, 0.0, 0.02])
    reckoning = drive(step, 3, odom_from_map=np.array([4.0, 3.0, 1.0]))
    by_wheels = IDENTITY
    for number in (4, 5):
        by_wheels = compose(by_wheels, step)
        reckoning.add_odometry(Odometry(number * PERIOD, by_wheels, IDENTITY))
        reckoning.advance(scan_at(ROOM, compose(base_after(step, number), PLACE), number * PERIOD, PLACE))
    assert reckoning.wheel_step() is None
    np.testing.assert_allclose(reckoning.guesses().motions[0], laser_step(step, 5), atol=0.05)
    reckoning.start_keyframe(laser_step(step, 5), SEEN)
    by_wheels = compose(by_wheels, step)
    reckoning.add_odometry(Odometry(6 * PERIOD, by_wheels, IDENTITY))
    reckoning.advance(scan_at(ROOM, compose(base_after(step, 6), PLACE), 6 * PERIOD, PLACE))
    np.testing.assert_allclose(reckoning.wheel_step(), laser_step(step, 1), atol=1e-9)


def test_without_odometry_the_velocity_is_trusted_after_a_while() -> None:
    step = np.array([0.02, 0.0, 0.01])
    reckoning = drive(step, 24, odom_from_map=None)
    by_velocity, by_scans, _ = reckoning.guesses().motions
    np.testing.assert_allclose(by_velocity, laser_step(step, 24), atol=0.01)
    np.testing.assert_allclose(by_scans, laser_step(step, 24), atol=0.05)


def test_where_wheels_fall_silent_the_velocity_begins_at_once() -> None:
    """With the speed and from the place that they reported last."""
    step = np.array([0.02, 0.0, 0.01])
    reckoning = drive(step, 3)
    silent = range(9, 32)
    for number in range(4, 9):
        reckoning.add_odometry(Odometry(number * PERIOD, base_after(step, number), IDENTITY))
        reckoning.advance(scan_at(ROOM, compose(base_after(step, number), PLACE), number * PERIOD, PLACE))
    stamps = [8 * PERIOD + 600_000_000 + (number - 9) * PERIOD for number in silent]
    for number, stamp in zip(silent, stamps, strict=True):
        reckoning.advance(scan_at(ROOM, compose(base_after(step, number), PLACE), stamp, PLACE))
    assert reckoning.wheel_step() is None
    np.testing.assert_allclose(reckoning.guesses().motions[0], laser_step(step, 31), atol=0.02)


@pytest.mark.parametrize(("step", "is_left_out"), [(IDENTITY, True), (np.array([0.1, 0.0, 0.02]), False)])
def test_where_scans_see_nothing_again_only_wheels_that_stand_are_left_out(
    step: Pose, is_left_out: bool
) -> None:
    reckoning = drive(step, 20)
    assert reckoning.wheel_step() is not None
    reckoning.doubt_standing()
    assert (reckoning.wheel_step() is None) == is_left_out
