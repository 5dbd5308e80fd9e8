from dataclasses import replace

import numpy as np
import pytest

from racecar.maps.geometry.se2 import between, wrap_angle
from racecar.sensors.self_calibration.profile_turn import bearing_profile, turn_between
from racecar.sensors.self_calibration.scan_track import ScanTracker, track_of
from tests.sensors.drives import Laser, poses_at, scans_of, winding_drive
from tests.sensors.worlds import ROOM, points_at

DRIVE = winding_drive(10.0)


def test_the_track_is_where_the_laser_was_in_the_middle_of_each_sweep() -> None:
    laser = Laser(noise=0.0)
    track = track_of(scans_of(DRIVE, 10.0, laser))
    truth = poses_at(DRIVE, track.stamps * 1e-9)
    assert track.stamps[0] == pytest.approx(0.5e9 * laser.sweep, abs=1)
    errors = between(between(truth[0], truth), between(track.track_from_laser[0], track.track_from_laser))
    assert np.abs(errors[:, :2]).max() < 0.08
    assert np.abs(errors[:, 2]).max() < 0.03


def test_turns_of_half_a_radian_between_two_scans_are_followed() -> None:
    drive = winding_drive(8.0, turn_rate=2.2)
    track = track_of(scans_of(drive, 8.0, Laser(rate=4.0, sweep=0.0)))
    truth = poses_at(drive, track.stamps * 1e-9)
    assert np.abs(np.diff(truth[:, 2])).max() > 0.5
    turned = track.track_from_laser[:, 2] - track.track_from_laser[0, 2]
    assert np.abs(wrap_angle(turned - (truth[:, 2] - truth[0, 2]))).max() < 0.05


def test_velocities_are_those_of_the_laser() -> None:
    track = track_of(scans_of(DRIVE, 6.0))
    velocities = track.velocities()
    assert np.isnan(velocities[[0, -1]]).all()
    seconds = track.stamps[1:-1] * 1e-9
    turns = poses_at(DRIVE, seconds + 0.1)[:, 2] - poses_at(DRIVE, seconds - 0.1)[:, 2]
    truth = wrap_angle(turns) / 0.2
    assert np.abs(velocities[1:-1, 2] - truth).max() < 0.15
    assert np.median(np.hypot(*velocities[1:-1, :2].T)) == pytest.approx(0.5, abs=0.03)
    assert np.median(velocities[1:-1, 0]) == pytest.approx(0.5, abs=0.03)


def test_a_gap_begins_another_segment() -> None:
    scans = scans_of(DRIVE, 4.0)
    later = [replace(scan, stamp=scan.stamp + 10_000_000_000) for scan in scans]
    track = track_of([*scans, *later])
    assert track.segment.tolist() == [0] * len(scans) + [1] * len(scans)
    assert np.isnan(track.velocities()[len(scans) - 1 : len(scans) + 1]).all()


def test_a_laser_that_stands_is_not_registered_over_and_over() -> None:
    scans = scans_of(np.zeros((900, 3)), 5.0, Laser(noise=0.0))
    tracker = ScanTracker()
    assert all(tracker.add(scan) for scan in scans)
    assert (tracker.track().track_from_laser == tracker.track().track_from_laser[0]).all()
    assert tracker.turned == tracker.distance == 0.0


def test_scans_that_come_more_often_are_left_out() -> None:
    tracker = ScanTracker()
    taken = [tracker.add(scan) for scan in scans_of(DRIVE, 1.0, Laser(rate=40.0, sweep=0.01))]
    assert taken == [index % 3 == 0 for index in range(40)]
    assert len(tracker) == 14


def profile(x: float, y: float, yaw: float) -> np.ndarray:
    return bearing_profile(points_at(ROOM, np.array([x, y, yaw])))


@pytest.mark.parametrize("turn", [-0.7, -0.2, 0.0, 0.35, 0.75])
def test_the_turn_is_found_from_a_wrong_guess(turn: float) -> None:
    found = turn_between(profile(0.0, 0.0, 0.3), profile(0.1, 0.05, 0.3 + turn), -turn)
    assert found == pytest.approx(turn, abs=0.03)


def test_a_guess_stays_that_fits_or_that_nothing_was_seen_for() -> None:
    assert turn_between(profile(0.0, 0.0, 0.0), profile(0.0, 0.0, 0.2), 0.204) == 0.204
    assert turn_between(bearing_profile(np.zeros((0, 2))), profile(0.0, 0.0, 0.0), 0.1) == 0.1
