import numpy as np

from racecar.mapping.self_calibration.config import StuckOdometryConfig, WindowConfig
from racecar.mapping.self_calibration.stuck_odometry import is_stuck
from racecar.mapping.self_calibration.wheel_track import WheelTrack, motion_pairs, windows_of
from racecar.maps.geometry.se2 import Pose
from tests.mapping.self_calibration.moving_laser import odometry_of, straight_drive, winding_drive
from tests.mapping.self_calibration.test_turn_agreement import track_along

DRIVE = winding_drive(40.0)


def sticks(by_wheels: Pose, drive: Pose = DRIVE) -> bool:
    track = track_along(drive)
    wheels = WheelTrack.of(odometry_of(by_wheels, 40.0))
    motions = motion_pairs(track, wheels, windows_of(track, WindowConfig()), 0)
    return is_stuck(motions, StuckOdometryConfig())


def test_a_constant_is_stuck() -> None:
    assert sticks(0.0 * DRIVE)
    assert sticks(0.0 * DRIVE + [3.0, -2.0, 1.0])


def test_wheels_that_drive_are_not() -> None:
    assert not sticks(DRIVE)
    assert not sticks(DRIVE * [0.2, 0.2, 0.2])


def test_a_robot_that_is_carried_with_a_gyro_is_not() -> None:
    assert not sticks(DRIVE * [0.0, 0.0, 1.0])


def test_one_that_stands_is_not() -> None:
    assert not sticks(0.0 * DRIVE, drive=0.0 * DRIVE)
    assert not sticks(0.0 * DRIVE, drive=straight_drive(40.0) * 0.01)


def test_one_that_sticks_half_of_the_time_is_not() -> None:
    held = DRIVE.copy()
    held[: len(held) // 2] = held[len(held) // 2]
    assert not sticks(held)
    assert np.ptp(held[:, 0]) > 0.0
