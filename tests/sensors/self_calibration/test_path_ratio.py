import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.self_calibration.mount import MountEstimate, read_motion
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.wheel_track import WheelTrack
from tests.sensors.self_calibration.moving_laser import (
    STEP,
    odometry_of,
    scans_of,
    straight_drive,
    winding_drive,
)

SECONDS = 20.0
DRIVE = straight_drive(SECONDS)
CORRIDOR = np.array([[[-60.0, side], [60.0, side]] for side in (-1.0, 1.2)])


def track_of(drive: Pose, **world: np.ndarray) -> ScanTrack:
    """Of a laser on the base's origin, followed without error."""
    scans = scans_of(drive, SECONDS, **world)
    stamps = np.array([scan.stamp for scan in scans], dtype=np.int64)
    poses = drive[np.round(stamps * 1e-9 / STEP).astype(int)]
    return ScanTrack(scans, stamps, poses, np.zeros(len(scans), dtype=np.int64))


ROOM_TRACK = track_of(DRIVE)


def mount_by(track: ScanTrack, by_wheels: Pose) -> MountEstimate | None:
    reading = read_motion(track, WheelTrack.of(odometry_of(by_wheels, SECONDS)), 0, is_inverted=False)
    return None if reading is None else reading.mount


@pytest.mark.parametrize(("factor", "is_wrong"), [(1.0, False), (1.1, False), (0.3, True), (1.3, True)])
def test_the_path_by_wheels_for_a_metre_by_scans(factor: float, is_wrong: bool) -> None:
    mount = mount_by(ROOM_TRACK, DRIVE * [factor, factor, 1.0])
    assert mount is not None and mount.path_ratio == pytest.approx(factor, rel=0.03)
    assert mount.has_wrong_path == is_wrong


def test_a_bare_corridor_shows_no_distance() -> None:
    assert mount_by(track_of(DRIVE, walls=CORRIDOR), 1.5 * DRIVE) is None


def test_scans_that_were_followed_wrongly_show_nothing() -> None:
    slipping = DRIVE.copy()
    slipping[:, 0] = np.cumsum(np.gradient(DRIVE[:, 0]) * (1.5 + np.sin(3.0 * np.arange(len(DRIVE)) * STEP)))
    mount = mount_by(ROOM_TRACK, slipping)
    assert mount is not None and not mount.is_clear and not mount.has_wrong_path


def test_a_laser_that_seems_to_sit_beside_its_robot_was_followed_wrongly() -> None:
    """As in a hall of which little is seen: that far away, a turn is a way."""
    drive = winding_drive(SECONDS)
    near, far = (mount_by(track_of(compose(drive, np.array([0.0, y, 0.0]))), drive) for y in (0.5, 3.0))
    assert near is not None and near.is_certain
    assert far is not None and far.base_from_laser[1] == pytest.approx(3.0, abs=0.2) and not far.is_certain
