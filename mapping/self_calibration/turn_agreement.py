"""Which lag of the wheels' clock, and which sense of their turns, agrees with the turns that scans show.

Turns are the one motion that laser and base have in common wherever the laser sits, so they are compared
before anything is known of the mount. The lag is that of the cross-correlation of both angular rates [Furgale
et al., "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013], with absolute
differences, since wheels slip.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    turns, by_wheels, is_covered, scans_apart = turns_at(track, wheels, lags, config)
    turned = float(np.abs(turns).sum()) / scans_apart
    if turned < config.min_turn:
        return None
    shares = np.stack([_shares_left(turns, sign * by_wheels, is_covered, config) for sign in (1.0, -1.0)])
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
    return TurnAgreement(lag, is_inverted, share) if share < config.max_share_left else None


def _lags(config: TurnAgreementConfig, expected_lag: int) -> NDArray[np.int64]:
    """(L,) nanoseconds that are tried, ascending: about none, and about the expected one."""
    step = round(config.step * 1e9)
    many, few = round(config.max_lag / config.step), round(config.usual_lag / config.step)
    about_none = np.arange(-many, many + 1) * step
    about_expected = (round(expected_lag / step) + np.arange(-few, few + 1)) * step
    return np.union1d(about_none, about_expected).astype(np.int64)


def turns_at(
    track: ScanTrack, wheels: WheelTrack, lags: NDArray[np.int64], config: TurnAgreementConfig
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], float]:
    """Turns (W,) by scans over overlapping windows, those (L, W) by wheels at each lag, whether the wheels
    cover them, and how many scans a window spans on average."""
    stamps = track.stamps
    ends = np.searchsorted(stamps, stamps + round(config.window.length * 1e9))
    begins = np.nonzero(ends < len(stamps))[0]
    ends = ends[begins]
    is_whole = (track.segment[begins] == track.segment[ends]) & (
        stamps[ends] - stamps[begins] < round(config.window.max_length * 1e9)
    )
    begins, ends = begins[is_whole], ends[is_whole]
    if len(begins) == 0 or len(wheels.stamps) < 2:
        return np.zeros(0), np.zeros((len(lags), 0)), np.zeros((len(lags), 0), dtype=np.bool_), 1.0
    headings = np.unwrap(track.track_from_laser[:, 2])
    turns = headings[ends] - headings[begins]
    seconds = (wheels.stamps - stamps[0]) * 1e-9
    wanted = (stamps - stamps[0] + lags[:, None]) * 1e-9
    at = np.interp(wanted, seconds, wheels.odom_from_base[:, 2])
    is_covered = (wanted[:, begins] >= seconds[0]) & (wanted[:, ends] <= seconds[-1])
    return turns, at[:, ends] - at[:, begins], is_covered, float(np.mean(ends - begins))


def _shares_left(
    turns: NDArray[np.float64],
    by_wheels: NDArray[np.float64],
    is_covered: NDArray[np.bool_],
    config: TurnAgreementConfig,
) -> NDArray[np.float64]:
    """(L,) of the turns (W,) what the wheels' (L, W) leave; inf for lags at which they cover too little."""
    differences = np.minimum(np.abs(turns - by_wheels), config.max_difference)
    whole = np.minimum(np.abs(turns), config.max_difference) * is_covered
    turned = whole.sum(axis=1)
    shares: NDArray[np.float64] = (differences * is_covered).sum(axis=1) / np.maximum(turned, 1e-9)
    shares[turned < config.min_covered * np.minimum(np.abs(turns), config.max_difference).sum()] = np.inf
    return shares
