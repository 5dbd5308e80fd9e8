import numpy as np
import pytest

from racecar.mapping.self_calibration.distance_ratio import DistanceRatio, distance_ratio
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import WheelTrack
from racecar.maps.geometry.se2 import Pose
from tests.mapping.self_calibration.moving_laser import STEP, odometry_of, scans_of, straight_drive

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


def ratio(track: ScanTrack, by_wheels: Pose) -> DistanceRatio | None:
    return distance_ratio(track, WheelTrack.of(odometry_of(by_wheels, SECONDS)), 0)


@pytest.mark.parametrize(("factor", "is_wrong"), [(1.0, False), (1.1, False), (0.3, True), (1.3, True)])
def test_the_distance_by_wheels_for_a_metre_by_scans(factor: float, is_wrong: bool) -> None:
    told = ratio(ROOM_TRACK, DRIVE * [factor, factor, 1.0])
    assert told is not None and told.value == pytest.approx(factor, rel=0.03)
    assert told.is_wrong == is_wrong
    assert not told.contradicts_turns


def test_a_bare_corridor_shows_no_distance() -> None:
    assert ratio(track_of(DRIVE, walls=CORRIDOR), 1.5 * DRIVE) is None


def test_scans_that_were_followed_wrongly_show_nothing() -> None:
    slipping = DRIVE.copy()
    slipping[:, 0] = np.cumsum(np.gradient(DRIVE[:, 0]) * (1.5 + np.sin(3.0 * np.arange(len(DRIVE)) * STEP)))
    assert ratio(ROOM_TRACK, slipping) is None


def test_wheels_that_do_not_go_where_they_look() -> None:
    """A circle with x and y exchanged is run through the other way round."""
    angle = np.linspace(0.0, 2.0 * np.pi, len(DRIVE))
    circle = np.column_stack([np.sin(angle), 1.0 - np.cos(angle), angle])
    track = track_of(circle)
    sound, exchanged = ratio(track, circle), ratio(track, circle[:, [1, 0, 2]])
    assert sound is not None and not sound.contradicts_turns
    assert exchanged is not None and exchanged.contradicts_turns
