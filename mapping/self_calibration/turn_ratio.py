"""By how much the scans turn when another sensor reports a turn: the ratio of the scales of both.

It is near 1 unless one of the two counts in other units, to the other side, or, of scans, over another angle
than it states. It is a robust regression at the lag at which the turns of both correlate best, which no scale
changes, and its deviation that of a bootstrap over blocks of time, as that of the lag.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.turn_agreement import (
    LAG_STEP,
    USUAL_LAG,
    WINDOW,
    nearer_to,
    shown_lag,
    turns_at,
)
from racecar.mapping.self_calibration.wheel_track import WheelTrack

_ROUNDS = 10
"""Of reweighting, since the weights hardly change after a few."""
_MIN_TURN = 2.0
"""Radians that the scans must have turned, to and fro; by judgement: a bend or two."""
_MIN_CORRELATION = 0.9
"""Correlation of the turns of both from which they measure the same. Measured on 30 recordings: 0.93 to 1,
and 0.97 with scans whose angles are stated half."""
_BLOCK = 1.0
"""Seconds of a block of the bootstrap, since windows within it err together."""
_MIN_BLOCKS = 6
"""Blocks below which nothing is decided, since their spread is not known from fewer."""
_RESAMPLINGS = 100
"""Of the bootstrap; by judgement: they tell a deviation to 7 %."""
RIGHT_FACTOR = 1.4
"""Factor between the turns of both within which none is wrong. Measured on recordings that are right: 0.80 to
1.07; steering that is not calibrated is off by so much."""


@dataclass(frozen=True)
class TurnRatio:
    """How the turns of the scans relate to those of another sensor."""

    value: float
    """Radians that the scans turn while the other reports one; negative where it turns to the other side."""
    sigma: float
    """Standard deviation."""
    lag: int
    """Nanoseconds by which the other's samples are stamped later than the scans."""

    def differs(self, other: float, share: float) -> bool:
        """Whether it is surely more than a share away from another ratio."""
        return abs(self.value - other) > share * abs(other) + 3.0 * self.sigma

    def is_beyond(self, factor: float) -> bool:
        """Whether one of the two surely turns by more than so many times the other."""
        size = abs(self.value)
        return size - 3.0 * self.sigma > factor or size + 3.0 * self.sigma < 1.0 / factor


def turn_ratio(track: ScanTrack, other: WheelTrack, expected_lag: int = 0) -> TurnRatio | None:
    """The ratio; None where too little was turned, or the turns of both have nothing in common at the usual
    lags and those about the expected one (nanoseconds)."""
    about_none = np.arange(-(USUAL_LAG // LAG_STEP), USUAL_LAG // LAG_STEP + 1)
    about_expected = about_none + round(expected_lag / LAG_STEP)
    lags = np.union1d(about_none, about_expected).astype(np.int64) * LAG_STEP
    seen = turns_at(track, other, lags)
    if seen.turned < _MIN_TURN:
        return None
    products = (seen.is_covered * seen.turns * seen.by_other).sum(axis=1)
    sizes = (seen.is_covered * seen.turns**2).sum(axis=1) * (seen.is_covered * seen.by_other**2).sum(axis=1)
    correlations = np.abs(products) / np.maximum(np.sqrt(sizes), 1e-12)
    best = int(np.argmax(correlations))
    if correlations[best] < _MIN_CORRELATION or best in (0, len(lags) - 1):
        return None
    chosen = seen.is_covered[best]
    turns, by_other = seen.turns[chosen], seen.by_other[best, chosen]
    blocks = np.arange(len(turns)) // max(round(seen.scans_apart * _BLOCK / WINDOW), 1)
    count = int(blocks[-1]) + 1
    if count < _MIN_BLOCKS:
        return None
    value, weights = _slope(by_other, turns)
    parts = np.stack(
        [
            np.bincount(blocks, weights * by_other * turns, count),
            np.bincount(blocks, weights * by_other**2, count),
        ]
    )
    draws = np.random.default_rng(0).multinomial(count, np.full(count, 1.0 / count), _RESAMPLINGS)
    above, below = parts @ draws.T
    sigma = float(np.std(above / np.maximum(below, 1e-12)))
    lag = int(lags[best])
    expected = nearer_to(lag, expected_lag)
    shown = shown_lag(track, seen, lags, (lag, expected), value)
    return TurnRatio(value, sigma, expected if shown is None else shown)


def _slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """The slope of y (W,) over x (W,) through zero, with Cauchy weights (W,), since wheels slip."""
    weights = np.ones(len(x))
    slope = 0.0
    for _ in range(_ROUNDS):
        slope = float((weights * x * y).sum() / (weights * x * x).sum())
        missed = np.abs(y - slope * x)
        weights = 1.0 / (1.0 + (missed / max(2.0 * float(np.median(missed)), 1e-3)) ** 2)
    return slope, weights
