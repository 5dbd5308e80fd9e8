import numpy as np

from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.self_calibration.odometry_fault import OdometryFault, odometry_fault
from racecar.sensors.self_calibration.wheel_track import WheelTrack, motion_pairs
from tests.sensors.self_calibration.moving_laser import odometry_of, straight_drive, winding_drive
from tests.sensors.self_calibration.test_turn_agreement import track_along

DRIVE = winding_drive(40.0)


def fault(by_wheels: Pose, drive: Pose = DRIVE) -> OdometryFault | None:
    track = track_along(drive)
    samples = odometry_of(by_wheels, 40.0)
    return odometry_fault(samples, motion_pairs(track, WheelTrack.of(samples), 0))


def is_sound(by_wheels: Pose, drive: Pose = DRIVE) -> bool:
    return fault(by_wheels, drive) is None


def test_a_constant_is_stuck() -> None:
    assert fault(0.0 * DRIVE) == OdometryFault.STUCK
    assert fault(0.0 * DRIVE + [3.0, -2.0, 1.0]) == OdometryFault.STUCK


def test_wheels_that_drive_are_not() -> None:
    assert is_sound(DRIVE)
    assert is_sound(DRIVE * [0.2, 0.2, 0.2])


def test_wheels_that_turn_and_go_nowhere() -> None:
    """As those of a robot that is carried and has a gyroscope, too."""
    drive = winding_drive(40.0, turn_rate=0.4)
    for share in (0.0, 0.01):
        assert fault(drive * [share, share, 1.0], drive) == OdometryFault.WITHOUT_DISTANCE
    assert is_sound(drive * [0.2, 0.2, 1.0], drive)


def test_a_laser_that_circles_the_middle_of_its_robot_is_not_one_that_travels() -> None:
    turning = np.linspace(0.0, 20.0, len(DRIVE))
    on_the_spot = np.column_stack([0.0 * turning, 0.0 * turning, turning])
    assert is_sound(on_the_spot, drive=compose(on_the_spot, np.array([0.6, 0.0, 0.0])))


def test_one_that_stands_is_not() -> None:
    assert is_sound(0.0 * DRIVE, drive=0.0 * DRIVE)
    assert is_sound(0.0 * DRIVE, drive=straight_drive(40.0) * 0.01)


def test_one_that_sticks_half_of_the_time_is_not() -> None:
    held = DRIVE.copy()
    held[: len(held) // 2] = held[len(held) // 2]
    assert is_sound(held)
    assert np.ptp(held[:, 0]) > 0.0


def test_wheels_that_never_turn() -> None:
    along = np.cumsum(np.hypot(*np.diff(DRIVE[:, :2], axis=0, prepend=DRIVE[:1, :2]).T))
    straight = np.column_stack([along, np.zeros((len(along), 2))])
    assert fault(straight) == OdometryFault.WITHOUT_TURNS
    assert is_sound(straight_drive(40.0), drive=straight_drive(40.0))


def test_millimetres_and_degrees_are_impossible() -> None:
    assert fault(DRIVE * [1e3, 1e3, 1.0]) == OdometryFault.IMPOSSIBLE
    assert fault(DRIVE * [1.0, 1.0, np.degrees(1.0)]) == OdometryFault.IMPOSSIBLE


def test_a_driver_that_starts_anew_is_possible() -> None:
    again = np.concatenate([DRIVE[: len(DRIVE) // 2], DRIVE[len(DRIVE) // 2 :] - DRIVE[len(DRIVE) // 2]])
    assert is_sound(again)
