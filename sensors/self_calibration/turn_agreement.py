"""Estimate lag and scale of another sensor's turns relative to those of the scans.

Laser and base turn alike wherever the laser is mounted, so turns are compared before the mount is known. The
lag is that of the cross-correlation of both turn rates [Furgale et al., "Unified temporal and spatial
calibration for multi-sensor systems", IROS 2013], with absolute differences, since wheels slip. The scale is
near 1 unless one sensor uses other units, the opposite sign or, for scans, wrong angles.
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
"""Nanoseconds to each side that are searched. Chosen by judgement: unsynchronized clocks are seconds apart,
or so far that no turn shows it."""
USUAL_LAG = 400_000_000
"""Nanoseconds of lag without a clock being wrong, since buses and drivers cause as much. Measured on
strangers' recordings: up to 0.33 s."""
RIGHT_FACTOR = 1.4
"""Ratio of the turns of both within which neither is wrong. Measured on recordings that are right: 0.80 to
1.07; uncalibrated steering reaches this ratio."""
_STEP = 20_000_000
"""Nanoseconds between searched lags, because odometry usually has this period."""
_PEAK_WIDTH = 500_000_000
"""Nanoseconds around the best lag that are the same hypothesis. Chosen by judgement: a window."""
_MAX_DIFFERENCE = 0.3
"""Radians at which the difference of turns in a window is clipped. Chosen by judgement: a slip."""
_MIN_COVERED = 0.5
"""Share of the turns that the other must cover at a lag. Chosen by judgement: half of a drive."""
_MIN_TURN = 1.5
"""Radians that the scans must turn in total. Chosen by judgement: a quarter turn there and back."""
_MIN_TURN_OF_FAR_LAG = 4.0
"""The same for an unusual lag, since there are many of them, and one fits few turns by chance."""
_MAX_SHARE_LEFT = 0.6
"""Unexplained share of the scans' turns, at most, for agreement. Measured on 30 recordings: the true
hypothesis leaves 0.03 to 0.55, a wrong one mostly over 1."""
_MAX_SHARE_OF_RIVAL = 0.6
"""Unexplained share of a fault relative to the best other hypothesis, at most. Measured likewise: 0.04 to 0.1
where it is true, 0.8 and more elsewhere."""
_NOISE = 0.0005
"""Radians, lower bound of the noise of turns, since a match is no better; chosen by judgement."""


@dataclass(frozen=True)
class TurnAgreement:
    """The hypothesis about another sensor's turns that best fits the scans'."""

    lag: int
    """Nanoseconds by which its stamps are later than the scans'."""
    ratio: float
    """Radians turned by the scans per radian of the other sensor; negative if signs are opposite."""
    sigma: float
    """Standard deviation of the ratio."""
    share_left: float
    """Share of the scans' turns that remains unexplained."""
    share_as_stated: float = np.inf
    """The same if the turns were as far as the other sensor states, though perhaps of the other sign."""

    @property
    def is_inverted(self) -> bool:
        """Whether one of the two has the wrong sign."""
        return self.ratio < 0.0

    def differs(self, other: float, share: float) -> bool:
        """Whether the ratio significantly differs from another by more than a share of it."""
        return abs(self.ratio - other) > share * abs(other) + SIGMAS * self.sigma

    @property
    def is_scaled(self) -> bool:
        """Whether one of the two is wrong by a factor.

        Slow sweeps along a bend look alike, so that the scans' track sticks there for a while, and turns too
        little on the whole. A true factor fits throughout, and far better than none.
        """
        fits = self.share_left < _MAX_SHARE_OF_RIVAL * self.share_as_stated
        return fits and self.is_beyond(RIGHT_FACTOR)

    def is_beyond(self, factor: float) -> bool:
        """Whether the ratio or its inverse is significantly above a factor."""
        size = abs(self.ratio)
        return size - SIGMAS * self.sigma > factor or size + SIGMAS * self.sigma < 1.0 / factor


def turn_agreement(
    track: ScanTrack, other: WheelTrack, expected_lag: int = 0, max_lag: int = MAX_LAG
) -> TurnAgreement | None:
    """The hypothesis that fits; None where none does, or the scans turned too little.

    Hypotheses of a fault, inverted turns or an unusual lag, must fit far better than all others. Lags near
    ``expected_lag`` (nanoseconds), from the times of recording, are no fault.
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
    # If turns are inverted at every lag, usual lags still do not indicate a clock fault.
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
    as_stated = _shares_left(windows, np.sign(ratios))
    return TurnAgreement(
        expected if shown is None else shown, ratio, sigma, float(shares[best]), float(as_stated[best])
    )


def _lags(expected_lag: int, max_lag: int) -> NDArray[np.int64]:
    """(L,) ascending lags in nanoseconds to search, around zero and around the expected one."""
    many, few = max_lag // _STEP, USUAL_LAG // _STEP
    about_expected = round(expected_lag / _STEP) + np.arange(-few, few + 1)
    return np.union1d(np.arange(-many, many + 1), about_expected).astype(np.int64) * _STEP


def _ratios(windows: TurnWindows) -> NDArray[np.float64]:
    """(L,) least-squares ratio of the turns at each lag; rounded to 1 or -1 if close, since few sensors have
    a wrong scale."""
    by_other = windows.is_covered * windows.by_other
    ratios = by_other @ windows.turns / np.maximum((by_other**2).sum(axis=1), 1e-12)
    is_as_stated = (np.abs(ratios) < RIGHT_FACTOR) & (np.abs(ratios) > 1.0 / RIGHT_FACTOR)
    return np.asarray(np.where(is_as_stated, np.sign(ratios), ratios))


def _shares_left(windows: TurnWindows, ratios: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L,) unexplained share of the turns; inf at lags where the other sensor covers too little."""
    left = np.abs(windows.turns - ratios[:, None] * windows.by_other)
    differences = np.minimum(left, _MAX_DIFFERENCE)
    all_turns = np.minimum(np.abs(windows.turns), _MAX_DIFFERENCE)
    turned = windows.is_covered @ all_turns
    shares: NDArray[np.float64] = (differences * windows.is_covered).sum(axis=1) / np.maximum(turned, 1e-9)
    shares[turned < _MIN_COVERED * all_turns.sum()] = np.inf
    return shares


def _ratio_at(track: ScanTrack, windows: TurnWindows, index: int) -> tuple[float, float]:
    """Ratio at one of the lags and its standard deviation, infinite with too few blocks of time."""
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
    """The refined lag around the one found, if blocks of time agree that it differs from the expected one;
    else None."""
    near = np.abs(lags - found[0]) <= _PEAK_WIDTH
    is_covered = np.asarray(windows.is_covered[near].all(axis=0))
    both = windows.chosen(is_covered).turning()
    missed = np.minimum(np.abs(both.turns - ratio * both.by_other[near]), _MAX_DIFFERENCE)
    blocks = blocks_of(track.stamps[both.begins], missed)
    shown = known_lag(lags[near] - found[1], blocks)
    return None if shown is None else found[1] + shown
