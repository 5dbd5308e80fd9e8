"""Which lag of another sensor's clock, and which scale of its turns, agrees with the turns that scans show.

Turns are the one motion that laser and base have in common wherever the laser sits, so they are compared
before anything is known of the mount. The lag is that of the cross-correlation of both angular rates [Furgale
et al., "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013], with absolute
differences, since wheels slip. The scale is near 1 unless one of the two counts in other units, to the other
side, or, of scans, over another angle than it states.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.motion.lag_estimate import blocks_of, known_lag
from racecar.sensors.motion.turn_windows import TurnWindows
from racecar.sensors.self_calibration.robust_fit import MIN_BLOCKS, SIGMAS, blocks_at, robust_fit
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.wheel_track import WheelTrack, turns_at

MAX_LAG = 5_000_000_000
"""Nanoseconds to each side that are tried; by judgement: computers whose clocks are not synchronized are
seconds apart, or so far that no turn tells."""
USUAL_LAG = 400_000_000
"""Nanoseconds that wheels and scans may be apart without a clock being wrong, since buses and drivers delay
so much. Measured on strangers' recordings: up to 0.33 s."""
RIGHT_FACTOR = 1.4
"""Factor between the turns of both within which none is wrong. Measured on recordings that are right: 0.80 to
1.07; steering that is not calibrated is off by so much."""
_STEP = 20_000_000
"""Nanoseconds from one lag tried to the next, because odometry usually comes so often."""
_PEAK_WIDTH = 500_000_000
"""Nanoseconds about the best lag within which others are the same hypothesis; by judgement: a window."""
_MAX_DIFFERENCE = 0.3
"""Radians by which turns may differ in a window; more counts as much. By judgement: a slip."""
_MIN_COVERED = 0.5
"""Share of the turns that the other must cover at a lag; by judgement: half of a drive shows it."""
_MIN_TURN = 1.5
"""Radians that the scans must have turned, to and fro; by judgement: a quarter turn there and back."""
_MIN_TURN_OF_FAR_LAG = 4.0
"""The same for a lag beyond the usual, since there are many of them, and one fits few turns by chance."""
_MAX_SHARE_LEFT = 0.6
"""Share of the scans' turns that the other may leave where they agree. Measured on 30 recordings: the true
hypothesis leaves 0.03 to 0.55, a wrong one mostly over 1."""
_MAX_SHARE_OF_RIVAL = 0.6
"""Share of what the best other hypothesis leaves that one which speaks against the recording may leave.
Measured likewise: 0.04 to 0.1 where it is true, 0.8 and more elsewhere."""
_NOISE = 0.0005
"""Radians; turns are never taken to be better, since a match is not; by judgement."""


@dataclass(frozen=True)
class TurnAgreement:
    """The hypothesis about another sensor's turns that fits the scans'."""

    lag: int
    """Nanoseconds by which its samples are stamped later than the scans."""
    ratio: float
    """Radians that the scans turn while the other reports one; negative where it turns to the other side."""
    sigma: float
    """Standard deviation of that."""
    share_left: float
    """Share of the scans' turns that the other then leaves unexplained."""

    @property
    def is_inverted(self) -> bool:
        """Whether one of the two counts turns backwards."""
        return self.ratio < 0.0

    def differs(self, other: float, share: float) -> bool:
        """Whether the ratio is surely more than a share away from another one."""
        return abs(self.ratio - other) > share * abs(other) + SIGMAS * self.sigma

    def is_beyond(self, factor: float) -> bool:
        """Whether one of the two surely turns by more than so many times the other."""
        size = abs(self.ratio)
        return size - SIGMAS * self.sigma > factor or size + SIGMAS * self.sigma < 1.0 / factor


def turn_agreement(
    track: ScanTrack, other: WheelTrack, expected_lag: int = 0, max_lag: int = MAX_LAG
) -> TurnAgreement | None:
    """The hypothesis that fits; None where none does, or too little was turned.

    One that speaks against the recording, of inverted turns or a lag beyond the usual, must fit far better
    than all that do not. About the ``expected_lag`` (nanoseconds), which the times of recording suggest, a
    lag does not speak against it.
    """
    lags = _lags(expected_lag, max_lag)
    windows = turns_at(track, other, lags)
    if windows.turned < _MIN_TURN:
        return None
    ratios = _ratios(windows)
    shares = _shares_left(windows, ratios)
    is_near = np.minimum(np.abs(lags), np.abs(lags - expected_lag)) <= USUAL_LAG
    best = int(np.argmin(shares))
    is_usual = is_near & (ratios > 0.0)
    # Where the turns are inverted whatever the lag, the usual ones still do not speak against the clocks.
    of_usual = np.where(is_usual if is_usual.any() else is_near, shares, np.inf)
    usual = int(np.argmin(of_usual))
    rivals = shares[np.abs(lags - lags[best]) > _PEAK_WIDTH]
    rival = min(float(of_usual[usual]), float(rivals.min(initial=np.inf)))
    if best != usual and shares[best] >= _MAX_SHARE_OF_RIVAL * rival:
        best, shares = usual, of_usual
    if shares[best] >= _MAX_SHARE_LEFT or (not is_near[best] and windows.turned < _MIN_TURN_OF_FAR_LAG):
        return None
    lag = int(lags[best])
    expected = min((0, expected_lag), key=lambda expected: abs(expected - lag))
    shown = _shown_lag(track, windows, lags, (lag, expected), float(ratios[best]))
    if shown is None and not is_near[best]:
        return None
    ratio, sigma = _ratio_at(track, windows, best)
    return TurnAgreement(expected if shown is None else shown, ratio, sigma, float(shares[best]))


def _lags(expected_lag: int, max_lag: int) -> NDArray[np.int64]:
    """(L,) nanoseconds that are tried, ascending: about none, and about the expected one."""
    many, few = max_lag // _STEP, USUAL_LAG // _STEP
    about_expected = round(expected_lag / _STEP) + np.arange(-few, few + 1)
    return np.union1d(np.arange(-many, many + 1), about_expected).astype(np.int64) * _STEP


def _ratios(windows: TurnWindows) -> NDArray[np.float64]:
    """(L,) by which the other's turns must be multiplied, at each lag, by least squares; 1 or -1 where that
    is nearly so, since few sensors do not count as they state."""
    by_other = windows.is_covered * windows.by_other
    ratios = by_other @ windows.turns / np.maximum((by_other**2).sum(axis=1), 1e-12)
    is_as_stated = (np.abs(ratios) < RIGHT_FACTOR) & (np.abs(ratios) > 1.0 / RIGHT_FACTOR)
    return np.asarray(np.where(is_as_stated, np.sign(ratios), ratios))


def _shares_left(windows: TurnWindows, ratios: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L,) of the turns what the other's leave; inf for lags at which they cover too little."""
    left = np.abs(windows.turns - ratios[:, None] * windows.by_other)
    differences = np.minimum(left, _MAX_DIFFERENCE)
    all_turns = np.minimum(np.abs(windows.turns), _MAX_DIFFERENCE)
    turned = windows.is_covered @ all_turns
    shares: NDArray[np.float64] = (differences * windows.is_covered).sum(axis=1) / np.maximum(turned, 1e-9)
    shares[turned < _MIN_COVERED * all_turns.sum()] = np.inf
    return shares


def _ratio_at(track: ScanTrack, windows: TurnWindows, index: int) -> tuple[float, float]:
    """The ratio at one of the lags, and its standard deviation, which is infinite for few blocks of time."""
    is_covered = windows.is_covered[index]
    blocks = blocks_at(track.stamps[windows.begins[is_covered]])
    by_other, turns = windows.by_other[index, is_covered], windows.turns[is_covered]
    fit = robust_fit(
        by_other[:, None, None], turns[:, None], blocks, noise=_NOISE, prior=np.full((1, 1), 1e-12)
    )
    is_known = len(np.unique(blocks)) >= MIN_BLOCKS
    return float(fit.solution[0]), float(np.sqrt(fit.covariance[0, 0])) if is_known else np.inf


def _shown_lag(
    track: ScanTrack, windows: TurnWindows, lags: NDArray[np.int64], found: tuple[int, int], ratio: float
) -> int | None:
    """The lag about the one that was found, if blocks of time agree that it is not the one that was expected
    there."""
    near = np.abs(lags - found[0]) <= _PEAK_WIDTH
    is_covered = np.asarray(windows.is_covered[near].all(axis=0))
    both = windows.chosen(is_covered).turning()
    missed = np.minimum(np.abs(both.turns - ratio * both.by_other[near]), _MAX_DIFFERENCE)
    blocks = blocks_of(track.stamps[both.begins], missed)
    shown = known_lag(lags[near] - found[1], blocks)
    return None if shown is None else found[1] + shown
