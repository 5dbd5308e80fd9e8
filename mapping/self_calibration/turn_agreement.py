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
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import WheelTrack

MAX_LAG = 5.0
"""Seconds to each side that are tried; by judgement: computers whose clocks are not synchronized are seconds
apart, or so far that no turn tells."""
LAG_STEP = 20_000_000
"""Nanoseconds from one lag tried to the next, because odometry usually comes so often."""
USUAL_LAG = 400_000_000
"""Nanoseconds that wheels and scans may be apart without a clock being wrong, since buses and drivers delay
so much. Measured on strangers' recordings: up to 0.33 s."""
_PEAK_WIDTH = 500_000_000
"""Nanoseconds about the best lag within which others are the same hypothesis; by judgement: the length of a
window."""
WINDOW = 0.5
"""Seconds over which turns are compared, since in less the noise of a track hides slow turns."""
_MAX_WINDOW = 2.0
"""Seconds beyond which there is a gap in a window; by judgement: a few windows."""
_MAX_DIFFERENCE = 0.3
"""Radians by which turns may differ in a window; more counts as much. By judgement: a slip."""
_MIN_COVERED = 0.5
"""Share of the turns that the wheels must cover at a lag; by judgement: half of a drive shows it."""
_MIN_TURN = 1.5
"""Radians that the scans must have turned, to and fro; by judgement: a quarter turn there and back."""
_MIN_TURN_OF_FAR_LAG = 4.0
"""The same for a lag beyond the usual, since there are many of them, and one fits few turns by chance."""
_MAX_SHARE_LEFT = 0.6
"""Share of the scans' turns that the wheels may leave where they agree. Measured on 30 recordings: the true
hypothesis leaves 0.03 to 0.55, a wrong one mostly over 1."""
_MAX_SHARE_OF_RIVAL = 0.6
"""Share of what the best other hypothesis leaves that one which speaks against the recording may leave.
Measured likewise: 0.04 to 0.1 where it is true, 0.8 and more elsewhere."""


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
    track: ScanTrack, wheels: WheelTrack, expected_lag: int = 0, max_lag: float = MAX_LAG
) -> TurnAgreement | None:
    """The hypothesis that fits; None where none does, or too little was turned.

    One that speaks against the recording, of inverted turns or a lag beyond the usual, must fit far better
    than all that do not. About the ``expected_lag`` (nanoseconds), which the times of recording suggest, a
    lag does not speak against it.
    """
    lags = _lags(expected_lag, max_lag)
    windows = turns_at(track, wheels, lags)
    turned = windows.turned
    if turned < _MIN_TURN:
        return None
    shares = np.stack([_shares_left(windows, sign * windows.by_other) for sign in (1.0, -1.0)])
    is_usual = np.zeros(shares.shape, dtype=np.bool_)
    is_usual[0] = np.minimum(np.abs(lags), np.abs(lags - expected_lag)) <= USUAL_LAG
    best, usual = int(np.argmin(shares)), int(np.argmin(np.where(is_usual, shares, np.inf)))
    is_inverted, lag = best >= len(lags), int(lags[best % len(lags)])
    rivals = shares.copy()
    rivals[int(is_inverted), np.abs(lags - lag) <= _PEAK_WIDTH] = np.inf
    rival = min(float(shares.flat[usual]), float(rivals.min()))
    if best != usual and shares.flat[best] >= _MAX_SHARE_OF_RIVAL * rival:
        is_inverted, lag, best = False, int(lags[usual]), usual
    if not is_usual[0, best % len(lags)] and turned < _MIN_TURN_OF_FAR_LAG:
        return None
    share = float(shares.flat[best])
    if share >= _MAX_SHARE_LEFT:
        return None
    expected = nearer_to(lag, expected_lag)
    shown = shown_lag(track, windows, lags, (lag, expected), -1.0 if is_inverted else 1.0)
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
) -> int | None:
    """The lag about the one that was found, if blocks of time agree that it is not the one that was expected
    there; with a ``factor`` on what the other sensor turns."""
    near = np.abs(lags - found[0]) <= _PEAK_WIDTH
    is_covered = np.asarray(windows.is_covered[near].all(axis=0))
    both = windows.chosen(is_covered).turning()
    missed = np.minimum(np.abs(both.turns - factor * both.by_other[near]), _MAX_DIFFERENCE)
    blocks = blocks_of(track.stamps[both.begins], missed)
    shown = known_lag(lags[near] - found[1], blocks)
    return None if shown is None else found[1] + shown


def _lags(expected_lag: int, max_lag: float) -> NDArray[np.int64]:
    """(L,) nanoseconds that are tried, ascending: about none, and about the expected one."""
    many, few = round(max_lag * 1e9 / LAG_STEP), USUAL_LAG // LAG_STEP
    about_none = np.arange(-many, many + 1) * LAG_STEP
    about_expected = (round(expected_lag / LAG_STEP) + np.arange(-few, few + 1)) * LAG_STEP
    return np.union1d(about_none, about_expected).astype(np.int64)


def turns_at(track: ScanTrack, wheels: WheelTrack, lags: NDArray[np.int64]) -> TurnWindows:
    """Turns by scans and by wheels at each lag, over overlapping windows in which the scans were followed."""
    scans = track.stamps, np.unwrap(track.track_from_laser[:, 2])
    by_wheels = wheels.stamps, wheels.odom_from_base[:, 2]
    windows = turn_windows(scans, by_wheels, lags, WINDOW, _MAX_WINDOW)
    return windows.chosen(track.segment[windows.begins] == track.segment[windows.ends])


def _shares_left(windows: TurnWindows, by_wheels: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L,) of the turns what the wheels' (L, W) leave; inf for lags at which they cover too little."""
    differences = np.minimum(np.abs(windows.turns - by_wheels), _MAX_DIFFERENCE)
    all_turns = np.minimum(np.abs(windows.turns), _MAX_DIFFERENCE)
    turned = (all_turns * windows.is_covered).sum(axis=1)
    shares: NDArray[np.float64] = (differences * windows.is_covered).sum(axis=1) / np.maximum(turned, 1e-9)
    shares[turned < _MIN_COVERED * all_turns.sum()] = np.inf
    return shares
