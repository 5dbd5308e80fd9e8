from dataclasses import replace

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, wrap_angle
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.mount import MotionReading, MountEstimate, read_motion
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.wheel_track import WheelSigns, WheelTrack
from tests.sensors.drives import (
    STEP,
    odometry_of,
    scans_of,
    straight_drive,
    winding_drive,
)
from tests.sensors.self_calibration.test_turn_agreement import track_along

DRIVE = winding_drive(40.0)
WHEELS = WheelTrack.of(odometry_of(DRIVE, 40.0))
BEARINGS = np.linspace(-np.pi, np.pi, 240, endpoint=False)
ROUND = Scan(0, BEARINGS, np.full(240, 4.0), np.zeros(240), IDENTITY, 30.0)
"""Walls all around, that show motion in any direction."""


def track_of_laser(base_from_laser: Pose, noise: float = 0.003, drive: Pose = DRIVE) -> ScanTrack:
    track = track_along(drive)
    poses = compose(track.track_from_laser, base_from_laser)
    poses = poses + noise * np.random.default_rng(2).standard_normal(poses.shape)
    return replace(track, scans=[ROUND] * len(track), track_from_laser=poses)


def read(track: ScanTrack, wheels: WheelTrack = WHEELS, *, is_inverted: bool = False) -> MotionReading:
    reading = read_motion(track, wheels, 0, is_inverted=is_inverted)
    assert reading is not None
    return reading


@pytest.mark.parametrize("yaw", [0.0, 0.5, 1.5, np.pi, -2.2])
def test_the_place_is_found(yaw: float) -> None:
    place = np.array([0.25, -0.1, yaw])
    mount = read(track_of_laser(place)).mount
    assert mount.is_certain
    assert mount.base_from_laser[:2] == pytest.approx(place[:2], abs=0.03)
    assert wrap_angle(mount.base_from_laser[2] - yaw) == pytest.approx(0.0, abs=0.03)
    assert mount.path_ratio == pytest.approx(1.0, abs=0.03)
    assert mount.consistency > 0.95


def test_an_edge_that_it_is_mounted_along_is_taken_exactly() -> None:
    mount = read(track_of_laser(np.array([0.0, 0.0, np.pi + 0.05]))).mount
    assert abs(mount.as_mounted()[2]) == pytest.approx(np.pi)
    askew = read(track_of_laser(np.array([0.0, 0.0, 0.6]))).mount
    assert askew.as_mounted()[2] == askew.base_from_laser[2]


def test_the_place_is_in_metres_where_the_wheels_are_in_feet() -> None:
    in_feet = WheelTrack(WHEELS.stamps, WHEELS.odom_from_base / [0.3048, 0.3048, 1.0])
    mount = read(track_of_laser(np.array([0.25, -0.1, 0.0])), in_feet).mount
    assert mount.has_wrong_path and mount.path_ratio == pytest.approx(1.0 / 0.3048, rel=0.02)
    assert mount.as_mounted() == pytest.approx([0.25, -0.1, 0.0], abs=0.03)


@pytest.mark.parametrize("is_upside_down", [True, False])
def test_a_laser_upside_down_looks_like_mirrored_wheels(is_upside_down: bool) -> None:
    place, mirror = np.array([0.2, 0.1, np.pi / 2]), [1.0, -1.0, -1.0]
    track, wheels = track_of_laser(place), WHEELS
    if is_upside_down:
        track = replace(track, track_from_laser=track.track_from_laser * mirror)
        place = place * mirror
    else:
        wheels = WHEELS.read_as(WheelSigns.MIRRORED)
    reading = read(track, wheels, is_inverted=True)
    assert reading.wheel_signs == WheelSigns.MIRRORED
    assert reading.mount.base_from_laser == pytest.approx(place, abs=0.03)


@pytest.mark.parametrize(
    ("signs", "is_inverted"), [(WheelSigns.YAW_INVERTED, True), (WheelSigns.PATH_MIRRORED, False)]
)
def test_wheels_whose_yaw_or_path_alone_is_wrong_contradict_themselves(
    signs: WheelSigns, is_inverted: bool
) -> None:
    place = np.array([0.2, 0.0, 0.0])
    reading = read(track_of_laser(place), WHEELS.read_as(signs), is_inverted=is_inverted)
    assert reading.wheel_signs == signs
    assert reading.mount.base_from_laser == pytest.approx(place, abs=0.03)


def test_wheels_whose_x_and_y_are_exchanged_do_not_go_where_they_look() -> None:
    exchanged = WheelTrack(WHEELS.stamps, WHEELS.odom_from_base[:, [1, 0, 2]])
    assert read(track_of_laser(IDENTITY)).wheel_signs == WheelSigns.AS_RECORDED
    assert read(track_of_laser(IDENTITY), exchanged).wheel_signs == WheelSigns.PATH_MIRRORED


def test_wheels_of_another_drive_are_no_evidence() -> None:
    other = WheelTrack.of(odometry_of(winding_drive(40.0, turn_rate=-0.7, speed=0.3)[::-1], 40.0))
    reading = read_motion(track_of_laser(IDENTITY), other, 0, is_inverted=False)
    assert reading is None or not reading.mount.is_certain


def test_a_robot_that_hardly_travels_shows_nothing() -> None:
    drive = straight_drive(40.0) * [0.01, 1.0, 1.0]
    wheels = WheelTrack.of(odometry_of(drive, 40.0))
    assert read_motion(track_of_laser(IDENTITY, drive=drive), wheels, 0, is_inverted=False) is None


def test_without_turns_an_offset_is_not_made_up() -> None:
    drive = straight_drive(40.0)
    track = track_of_laser(np.array([0.3, 0.0, np.pi]), drive=drive)
    mount = read(track, WheelTrack.of(odometry_of(drive, 40.0))).mount
    assert mount.is_certain
    assert mount.as_mounted()[:2].tolist() == [0.0, 0.0]


def test_a_robot_that_drove_one_way_may_have_slipped_on_a_slope() -> None:
    mount = replace(read(track_of_laser(np.array([0.0, 0.0, 0.2]))).mount, one_way=0.1)
    assert mount.yaw_error(IDENTITY) == pytest.approx(0.2, abs=0.02)
    one_way = replace(mount, one_way=0.9)
    assert one_way.yaw_error(IDENTITY) == 0.0 and one_way.leaves_open(IDENTITY)
    assert not mount.leaves_open(IDENTITY) and not one_way.leaves_open(mount.base_from_laser)


SHORT = 20.0
STRAIGHT = straight_drive(SHORT)
CORRIDOR = np.array([[[-60.0, side], [60.0, side]] for side in (-1.0, 1.2)])


def track_of(drive: Pose, **world: np.ndarray) -> ScanTrack:
    """Of a laser on the base's origin, followed without error."""
    scans = scans_of(drive, SHORT, **world)
    stamps = np.array([scan.stamp for scan in scans], dtype=np.int64)
    poses = drive[np.round(stamps * 1e-9 / STEP).astype(int)]
    return ScanTrack(scans, stamps, poses, np.zeros(len(scans), dtype=np.int64))


ROOM_TRACK = track_of(STRAIGHT)


def mount_by(track: ScanTrack, by_wheels: Pose) -> MountEstimate | None:
    reading = read_motion(track, WheelTrack.of(odometry_of(by_wheels, SHORT)), 0, is_inverted=False)
    return None if reading is None else reading.mount


@pytest.mark.parametrize(("factor", "is_wrong"), [(1.0, False), (1.1, False), (0.3, True), (1.3, True)])
def test_the_path_by_wheels_for_a_metre_by_scans(factor: float, is_wrong: bool) -> None:
    mount = mount_by(ROOM_TRACK, STRAIGHT * [factor, factor, 1.0])
    assert mount is not None and mount.path_ratio == pytest.approx(factor, rel=0.03)
    assert mount.has_wrong_path == is_wrong


def test_a_bare_corridor_shows_no_distance() -> None:
    assert mount_by(track_of(STRAIGHT, walls=CORRIDOR), 1.5 * STRAIGHT) is None


def test_scans_that_were_followed_wrongly_show_nothing() -> None:
    slipping = STRAIGHT.copy()
    slipping[:, 0] = np.cumsum(
        np.gradient(STRAIGHT[:, 0]) * (1.5 + np.sin(3.0 * np.arange(len(STRAIGHT)) * STEP))
    )
    mount = mount_by(ROOM_TRACK, slipping)
    assert mount is not None and not mount.is_clear and not mount.has_wrong_path


def test_a_laser_that_seems_to_sit_beside_its_robot_was_followed_wrongly() -> None:
    """As in a hall of which little is seen: that far away, a turn is a way."""
    drive = winding_drive(SHORT)
    near, far = (mount_by(track_of(compose(drive, np.array([0.0, y, 0.0]))), drive) for y in (0.5, 3.0))
    assert near is not None and near.is_certain
    assert far is not None and far.base_from_laser[1] == pytest.approx(3.0, abs=0.2) and not far.is_certain
