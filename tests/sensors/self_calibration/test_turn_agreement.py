"""Turns by scans agree with those of another sensor at one lag and one scale, or not at all."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.turn_agreement import MAX_LAG, USUAL_LAG, TurnAgreement, turn_agreement
from racecar.sensors.self_calibration.wheel_track import WheelSigns, WheelTrack
from tests.sensors.drives import odometry_of, poses_at, straight_drive

SECONDS = 40.0
TIMES = np.arange(0.0, SECONDS + 2.0, 0.01)


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


def turning(factor: float, lag: float = 0.0, noise: float = 0.0) -> WheelTrack:
    """The same turns as other wheels count them."""
    wheels = WheelTrack.of(odometry_of(irregular_drive(), SECONDS, lag))
    poses = wheels.odom_from_base * [1.0, 1.0, factor]
    poses[:, 2] += noise * np.cumsum(np.random.default_rng(0).standard_normal(len(poses)))
    return WheelTrack(wheels.stamps, poses)


def agreed(other: WheelTrack, expected_lag: int = 0, max_lag: int = MAX_LAG) -> TurnAgreement | None:
    return turn_agreement(track_along(irregular_drive()), other, expected_lag, max_lag)


@pytest.mark.parametrize(("share_left", "as_stated"), [(0.563, 0.708), (0.485, 0.668)])
def test_a_track_that_sticks_now_and_then_shows_no_factor(share_left: float, as_stated: float) -> None:
    """Shares of two drives at 4 and 6 m/s round a bending track, of a laser of 7 sweeps a second."""
    assert not TurnAgreement(0, 0.6, 0.02, share_left, as_stated).is_scaled
    assert TurnAgreement(0, 0.6, 0.02, 0.1, as_stated).is_scaled


FACTORS = (1.0, 0.5, 2.0, -1.0, 57.3)


@pytest.mark.parametrize(
    ("factor", "lag", "max_lag"),
    [
        *((1.0, lag, MAX_LAG) for lag in (-4.6, -0.6, -0.1, 0.0, 0.12, 3.0)),
        *((-1.0, lag, MAX_LAG) for lag in (0.0, 2.0)),
        *((factor, lag, USUAL_LAG) for factor in FACTORS for lag in (0.0, -0.3, 0.25)),
    ],
)
def test_scale_and_lag_are_found(factor: float, lag: float, max_lag: int) -> None:
    agreement = agreed(turning(factor, lag), max_lag=max_lag)
    assert agreement is not None and agreement.is_inverted == (factor < 0.0)
    assert agreement.lag * 1e-9 == pytest.approx(lag, abs=0.03 if max_lag == MAX_LAG else 0.02)
    assert agreement.ratio == pytest.approx(1.0 / factor, rel=0.02)
    assert agreement.is_scaled == (abs(factor) != 1.0)


@pytest.mark.parametrize(
    ("factor", "lag", "expected", "max_lag"), [(1.0, 77.1, 77, MAX_LAG), (2.0, 3.1, 3, USUAL_LAG)]
)
def test_clocks_that_are_farther_apart_are_told_by_when_they_were_recorded(
    factor: float, lag: float, expected: int, max_lag: int
) -> None:
    assert agreed(turning(factor, lag), 0, max_lag) is None
    agreement = agreed(turning(factor, lag), expected * 1_000_000_000, max_lag)
    assert agreement is not None and agreement.lag * 1e-9 == pytest.approx(lag, abs=0.02)


def test_noise_shows_in_the_deviation() -> None:
    clean, noisy = (agreed(turning(1.0, noise=noise), max_lag=USUAL_LAG) for noise in (0.0, 0.01))
    assert clean is not None and noisy is not None
    assert noisy.sigma > 3.0 * clean.sigma
    assert abs(noisy.ratio - 1.0) < 4.0 * noisy.sigma


@pytest.mark.parametrize("max_lag", [MAX_LAG, USUAL_LAG])
@pytest.mark.parametrize(
    "other",
    [
        *(WheelTrack.of(odometry_of(irregular_drive(seed), SECONDS)) for seed in range(1, 9)),
        WheelTrack.of(odometry_of(straight_drive(SECONDS), SECONDS)),
        WheelTrack.of([]),
        WheelTrack.of_turns([]),
    ],
)
def test_turns_of_another_drive_agree_with_nothing(other: WheelTrack, max_lag: int) -> None:
    assert agreed(other, max_lag=max_lag) is None


def test_without_turns_nothing_is_known() -> None:
    drive = straight_drive(SECONDS)
    assert turn_agreement(track_along(drive), WheelTrack.of(odometry_of(drive, SECONDS))) is None


WAVES = np.column_stack([0.0 * TIMES, 0.0 * TIMES, np.sin(2.0 * np.pi * TIMES / 3.0)])
CIRCLE = np.column_stack([np.sin(0.5 * TIMES), 1.0 - np.cos(0.5 * TIMES), 0.5 * TIMES])


@pytest.mark.parametrize(
    ("drive", "scale", "signs"),
    [
        (WAVES, 0.9, WheelSigns.AS_RECORDED),
        (CIRCLE, 1.0, WheelSigns.AS_RECORDED),
        (CIRCLE, 1.0, WheelSigns.YAW_INVERTED),
    ],
)
def test_turns_that_repeat_or_go_on_alike_do_not_shift_the_clock(
    drive: Pose, scale: float, signs: WheelSigns
) -> None:
    """With one turn like another, a lag of a period fits as well as none; on a circle all lags fit."""
    wheels = WheelTrack.of(odometry_of(drive * [1.0, 1.0, scale], SECONDS)).read_as(signs)
    agreement = turn_agreement(track_along(drive), wheels)
    assert agreement is not None and abs(agreement.lag) < 0.1e9
    assert agreement.is_inverted == (signs == WheelSigns.YAW_INVERTED)
