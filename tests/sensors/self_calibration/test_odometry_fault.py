import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.sensors.self_calibration.odometry_fault import OdometryFault, odometry_fault
from racecar.sensors.self_calibration.wheel_track import WheelTrack, motion_pairs
from tests.sensors.drives import odometry_of, straight_drive, winding_drive
from tests.sensors.self_calibration.test_turn_agreement import track_along

DRIVE = winding_drive(40.0)
SLOWLY_TURNING = winding_drive(40.0, turn_rate=0.4)
STRAIGHT = straight_drive(40.0)
HALF = len(DRIVE) // 2
WAY = np.cumsum(np.hypot(*np.diff(DRIVE[:, :2], axis=0, prepend=DRIVE[:1, :2]).T))
FLICKER = np.arange(len(DRIVE))[:, None] % 2 * [0.001, 0.0, 0.001]
ON_THE_SPOT = np.linspace(0.0, 20.0, len(DRIVE))[:, None] * [0.0, 0.0, 1.0]


def reset(drive: Pose, every: int, offset: float = 0.0) -> Pose:
    """A drive whose odometry is set to zero at one of so many samples, or by so much of a step before it."""
    index = np.arange(len(drive))
    last = index // every * every
    share = np.where(last > 0, offset, 0.0)[:, None]
    zeros = drive[last] * (1.0 - share) + drive[np.maximum(last - 1, 0)] * share
    poses = compose(inverse(zeros), drive)
    return np.where((index == last)[:, None] & (offset == 0.0), 0.0, poses)


def fault(by_wheels: Pose, drive: Pose) -> OdometryFault | None:
    samples = odometry_of(by_wheels, 40.0)
    return odometry_fault(samples, motion_pairs(track_along(drive), WheelTrack.of(samples), 0))


@pytest.mark.parametrize(
    ("by_wheels", "drive", "expected"),
    [
        (0.0 * DRIVE, DRIVE, OdometryFault.STUCK),
        (0.0 * DRIVE + [3.0, -2.0, 1.0], DRIVE, OdometryFault.STUCK),
        # of robots that are carried and have a gyroscope, too
        (SLOWLY_TURNING * [0.0, 0.0, 1.0], SLOWLY_TURNING, OdometryFault.WITHOUT_DISTANCE),
        (SLOWLY_TURNING * [0.01, 0.01, 1.0], SLOWLY_TURNING, OdometryFault.WITHOUT_DISTANCE),
        (WAY[:, None] * [1.0, 0.0, 0.0], DRIVE, OdometryFault.WITHOUT_TURNS),
        (reset(DRIVE, 4), DRIVE, OdometryFault.RESETS),
        (reset(DRIVE, 10), DRIVE, OdometryFault.RESETS),
        (reset(DRIVE, 100), DRIVE, OdometryFault.RESETS),
        (reset(DRIVE, 10, 0.5), DRIVE, OdometryFault.RESETS),
        (DRIVE * [1e3, 1e3, 1.0], DRIVE, OdometryFault.IMPOSSIBLE),
        (DRIVE * [1.0, 1.0, np.degrees(1.0)], DRIVE, OdometryFault.IMPOSSIBLE),
    ],
)
def test_wheels_that_cannot_be_right_are_named(by_wheels: Pose, drive: Pose, expected: OdometryFault) -> None:
    assert fault(by_wheels, drive) == expected


@pytest.mark.parametrize(
    ("by_wheels", "drive"),
    [
        (DRIVE, DRIVE),
        (DRIVE * [0.2, 0.2, 0.2], DRIVE),
        (SLOWLY_TURNING * [0.2, 0.2, 1.0], SLOWLY_TURNING),
        (ON_THE_SPOT, compose(ON_THE_SPOT, np.array([0.6, 0.0, 0.0]))),  # the laser circles, nobody travels
        (0.0 * DRIVE, 0.0 * DRIVE),
        (0.0 * DRIVE, STRAIGHT * 0.01),
        (STRAIGHT, STRAIGHT),
        (reset(DRIVE, len(DRIVE) // 3), DRIVE),  # a driver that is started again and again
        (FLICKER, 0.0 * DRIVE),
        (np.concatenate([np.tile(DRIVE[HALF], (HALF, 1)), DRIVE[HALF:]]), DRIVE),  # stuck half of the time
        (np.concatenate([DRIVE[:HALF], DRIVE[HALF:] - DRIVE[HALF]]), DRIVE),  # a driver that is started again
    ],
)
def test_wheels_that_may_be_right_are_sound(by_wheels: Pose, drive: Pose) -> None:
    assert fault(by_wheels, drive) is None
