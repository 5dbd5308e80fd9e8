import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.turn_agreement import turn_agreement
from racecar.sensors.self_calibration.wheel_track import WheelSigns, WheelTrack
from tests.sensors.self_calibration.moving_laser import odometry_of, poses_at, straight_drive

SECONDS = 40.0


def irregular_drive(seed: int = 0) -> Pose:
    """A turn now and then, of another size each time."""
    rng = np.random.default_rng(seed)
    rates = np.repeat(rng.uniform(-1.5, 1.5, 100) * (rng.uniform(size=100) < 0.4), 70)
    yaw = np.cumsum(rates) * 0.01
    return np.column_stack([0.003 * np.cumsum(np.cos(yaw)), 0.003 * np.cumsum(np.sin(yaw)), yaw])


def track_along(drive: Pose, seconds: float = SECONDS) -> ScanTrack:
    """As an exact tracker would have it, of ten scans a second."""
    times = np.arange(0.0, seconds, 0.1)
    stamps = np.round(times * 1e9).astype(np.int64)
    return ScanTrack([], stamps, poses_at(drive, times), np.zeros(len(times), dtype=np.int64))


def wheels_along(drive: Pose, lag: float = 0.0) -> WheelTrack:
    return WheelTrack.of(odometry_of(drive, SECONDS, lag))


@pytest.mark.parametrize("lag", [-4.6, -0.6, -0.1, 0.0, 0.12, 3.0])
def test_the_lag_is_found(lag: float) -> None:
    drive = irregular_drive()
    agreement = turn_agreement(track_along(drive), wheels_along(drive, lag))
    assert agreement is not None and not agreement.is_inverted
    assert agreement.lag * 1e-9 == pytest.approx(lag, abs=0.03)


@pytest.mark.parametrize("lag", [0.0, 2.0])
def test_inverted_turns_are_found(lag: float) -> None:
    drive = irregular_drive()
    wheels = wheels_along(drive, lag).read_as(WheelSigns.YAW_INVERTED)
    agreement = turn_agreement(track_along(drive), wheels)
    assert agreement is not None and agreement.is_inverted
    assert agreement.lag * 1e-9 == pytest.approx(lag, abs=0.03)


def test_clocks_that_are_farther_apart_are_told_by_when_they_were_recorded() -> None:
    drive = irregular_drive()
    wheels = wheels_along(drive, 77.1)
    assert turn_agreement(track_along(drive), wheels) is None
    agreement = turn_agreement(track_along(drive), wheels, expected_lag=77_000_000_000)
    assert agreement is not None and agreement.lag * 1e-9 == pytest.approx(77.1, abs=0.03)


@pytest.mark.parametrize("seed", range(1, 9))
def test_turns_of_another_drive_agree_with_nothing(seed: int) -> None:
    assert turn_agreement(track_along(irregular_drive()), wheels_along(irregular_drive(seed))) is None


def test_turns_that_repeat_do_not_shift_the_clock() -> None:
    """With one turn like another, a lag of a period fits as well as none."""
    times = np.arange(0.0, SECONDS + 2.0, 0.01)
    drive = np.column_stack([0.0 * times, 0.0 * times, np.sin(2.0 * np.pi * times / 3.0)])
    wheels = WheelTrack.of(odometry_of(drive * [1.0, 1.0, 0.9], SECONDS))
    agreement = turn_agreement(track_along(drive), wheels)
    assert agreement is not None and not agreement.is_inverted and abs(agreement.lag) < 0.1e9


@pytest.mark.parametrize("signs", [WheelSigns.AS_RECORDED, WheelSigns.YAW_INVERTED])
def test_turns_that_go_on_alike_do_not_shift_the_clock(signs: WheelSigns) -> None:
    """On a circle all lags fit, whichever way the wheels count."""
    times = np.arange(0.0, SECONDS + 2.0, 0.01)
    drive = np.column_stack([np.sin(0.5 * times), 1.0 - np.cos(0.5 * times), 0.5 * times])
    wheels = WheelTrack.of(odometry_of(drive, SECONDS)).read_as(signs)
    agreement = turn_agreement(track_along(drive), wheels)
    assert agreement is not None and abs(agreement.lag) < 0.1e9
    assert agreement.is_inverted == (signs == WheelSigns.YAW_INVERTED)


def test_without_turns_nothing_is_told() -> None:
    drive = straight_drive(SECONDS)
    assert turn_agreement(track_along(drive), wheels_along(drive)) is None
    assert turn_agreement(track_along(irregular_drive()), WheelTrack.of([])) is None
