"""Which lag of the wheels' clock, and which sense of their turns, agrees with the turns that scans show.

Turns are the one motion that laser and base have in common wherever the laser sits, so they are compared
before anything is known of the mount. The lag is that of the cross-correlation of both angular rates [Furgale
et al., "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013], with absolute
differences, since wheels slip.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.odometry.lag_estimate import blocks_of, known_lag
from racecar.mapping.odometry.turn_windows import TurnWindows, turn_windows
from racecar.mapping.self_calibration.config import TurnAgreementConfig
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import WheelTrack


@dataclass(frozen=True)
class TurnAgreement:
    """The hypothesis about the wheels' turns that fits the scans'."""

    lag: int
    """Nanoseconds by which the wheels' samples are stamped later than the scans."""
    is_inverted: bool
    """Whether the wheels, or the scans, count turns backwards."""
    share_left: float
    """Share of the scans' turns that the wheels then leave unexplained."""


def turn_agreement(
    track: ScanTrack, wheels: WheelTrack, config: TurnAgreementConfig, expected_lag: int = 0
) -> TurnAgreement | None:
    """The hypothesis that fits; None where none does, or too little was turned.

    One that speaks against the recording, of inverted turns or a lag beyond the usual, must fit far better
    than all that do not. About the ``expected_lag`` (nanoseconds), which the times of recording suggest, a
    lag does not speak against it.
    """
    lags = _lags(config, expected_lag)
    windows = turns_at(track, wheels, lags, config)
    turned = windows.turned
    if turned < config.min_turn:
        return None
    shares = np.stack([_shares_left(windows, sign * windows.by_other, config) for sign in (1.0, -1.0)])
    is_usual = np.zeros(shares.shape, dtype=np.bool_)
    is_usual[0] = np.minimum(np.abs(lags), np.abs(lags - expected_lag)) <= round(config.usual_lag * 1e9)
    best, usual = int(np.argmin(shares)), int(np.argmin(np.where(is_usual, shares, np.inf)))
    is_inverted, lag = best >= len(lags), int(lags[best % len(lags)])
    rivals = shares.copy()
    rivals[int(is_inverted), np.abs(lags - lag) <= round(config.peak_width * 1e9)] = np.inf
    rival = min(float(shares.flat[usual]), float(rivals.min()))
    if best != usual and shares.flat[best] >= config.max_share_of_rival * rival:
        is_inverted, lag, best = False, int(lags[usual]), usual
    if not is_usual[0, best % len(lags)] and turned < config.min_turn_of_far_lag:
        return None
    share = float(shares.flat[best])
    if share >= config.max_share_left:
        return None
    expected = nearer_to(lag, expected_lag)
    shown = shown_lag(track, windows, lags, (lag, expected), -1.0 if is_inverted else 1.0, config)
    if shown is None and not is_usual[0, best % len(lags)]:
        return None
    return TurnAgreement(expected if shown is None else shown, is_inverted, share)


def nearer_to(lag: int, expected_lag: int) -> int:
    """What is expected where a lag was found: none, or the one that the times of recording suggest."""
    return min((0, expected_lag), key=lambda expected: abs(expected - lag))


def shown_lag(
    track: ScanTrack,
    windows: TurnWindows,
    lags: NDArray[np.int64],
    found: tuple[int, int],
    factor: float,
    config: TurnAgreementConfig,
) -> int | None:
    """The lag about the one that was found, if blocks of time agree that it is not the one that was expected
    there; with a ``factor`` on what the other sensor turns."""
    near = np.abs(lags - found[0]) <= round(config.peak_width * 1e9)
    is_covered = np.asarray(windows.is_covered[near].all(axis=0))
    both = windows.chosen(is_covered).turning(config.lag.min_turn)
    missed = np.minimum(np.abs(both.turns - factor * both.by_other[near]), config.max_difference)
    blocks = blocks_of(track.stamps[both.begins], missed, config.lag)
    shown = known_lag(lags[near] - found[1], blocks, config.lag)
    return None if shown is None else found[1] + shown


def _lags(config: TurnAgreementConfig, expected_lag: int) -> NDArray[np.int64]:
    """(L,) nanoseconds that are tried, ascending: about none, and about the expected one."""
    step = round(config.step * 1e9)
    many, few = round(config.max_lag / config.step), round(config.usual_lag / config.step)
    about_none = np.arange(-many, many + 1) * step
    about_expected = (round(expected_lag / step) + np.arange(-few, few + 1)) * step
    return np.union1d(about_none, about_expected).astype(np.int64)


def turns_at(
    track: ScanTrack, wheels: WheelTrack, lags: NDArray[np.int64], config: TurnAgreementConfig
) -> TurnWindows:
    """Turns by scans and by wheels at each lag, over overlapping windows in which the scans were followed."""
    scans = track.stamps, np.unwrap(track.track_from_laser[:, 2])
    by_wheels = wheels.stamps, wheels.odom_from_base[:, 2]
    windows = turn_windows(scans, by_wheels, lags, config.window.length, config.window.max_length)
    return windows.chosen(track.segment[windows.begins] == track.segment[windows.ends])


def _shares_left(
    windows: TurnWindows, by_wheels: NDArray[np.float64], config: TurnAgreementConfig
) -> NDArray[np.float64]:
    """(L,) of the turns what the wheels' (L, W) leave; inf for lags at which they cover too little."""
    differences = np.minimum(np.abs(windows.turns - by_wheels), config.max_difference)
    all_turns = np.minimum(np.abs(windows.turns), config.max_difference)
    turned = (all_turns * windows.is_covered).sum(axis=1)
    shares: NDArray[np.float64] = (differences * windows.is_covered).sum(axis=1) / np.maximum(turned, 1e-9)
    shares[turned < config.min_covered * all_turns.sum()] = np.inf
    return shares
