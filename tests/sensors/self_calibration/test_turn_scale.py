import numpy as np
import pytest

from racecar.sensors.self_calibration.turn_agreement import USUAL_LAG, TurnAgreement, turn_agreement
from racecar.sensors.self_calibration.wheel_track import WheelTrack
from tests.sensors.self_calibration.moving_laser import straight_drive
from tests.sensors.self_calibration.test_turn_agreement import (
    SECONDS,
    irregular_drive,
    track_along,
    wheels_along,
)


def ratio_to(other: WheelTrack, expected_lag: int = 0) -> TurnAgreement | None:
    return turn_agreement(track_along(irregular_drive()), other, expected_lag, USUAL_LAG)


def turning(factor: float, lag: float = 0.0, noise: float = 0.0) -> WheelTrack:
    wheels = wheels_along(irregular_drive(), lag)
    poses = wheels.odom_from_base * [1.0, 1.0, factor]
    poses[:, 2] += noise * np.cumsum(np.random.default_rng(0).standard_normal(len(poses)))
    return WheelTrack(wheels.stamps, poses)


@pytest.mark.parametrize("factor", [1.0, 0.5, 2.0, -1.0, 57.3])
@pytest.mark.parametrize("lag", [0.0, -0.3, 0.25])
def test_scale_and_lag_are_found(factor: float, lag: float) -> None:
    ratio = ratio_to(turning(factor, lag))
    assert ratio is not None
    assert ratio.ratio == pytest.approx(1.0 / factor, rel=0.02)
    assert ratio.lag * 1e-9 == pytest.approx(lag, abs=0.02)
    assert ratio.is_beyond(1.4) == (abs(factor) != 1.0)


def test_a_lag_far_off_is_found_about_the_expected_one() -> None:
    assert ratio_to(turning(2.0, 3.1)) is None
    ratio = ratio_to(turning(2.0, 3.1), expected_lag=3_000_000_000)
    assert ratio is not None and ratio.lag * 1e-9 == pytest.approx(3.1, abs=0.02)


def test_noise_shows_in_the_deviation() -> None:
    ratio, noisy = ratio_to(turning(1.0)), ratio_to(turning(1.0, noise=0.01))
    assert ratio is not None and noisy is not None
    assert noisy.sigma > 3.0 * ratio.sigma
    assert abs(noisy.ratio - 1.0) < 4.0 * noisy.sigma


def test_turns_of_another_drive_have_no_ratio() -> None:
    assert ratio_to(wheels_along(irregular_drive(3))) is None
    assert ratio_to(wheels_along(straight_drive(SECONDS))) is None
    assert ratio_to(WheelTrack.of([])) is None
    assert ratio_to(WheelTrack.of_turns([])) is None
