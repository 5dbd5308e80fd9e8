"""By how much the scans turn when another sensor reports a turn: the ratio of the scales of both.

It is near 1 unless one of the two counts in other units, to the other side, or, of scans, over another angle
than it states. It is a robust regression at the lag at which the turns of both correlate best, which no scale
changes, and its deviation that of a bootstrap over blocks of time, as that of the lag.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.config import TurnAgreementConfig, TurnRatioConfig
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.turn_agreement import nearer_to, shown_lag, turns_at
from racecar.mapping.self_calibration.wheel_track import WheelTrack

_ROUNDS = 10
"""Of reweighting, since the weights hardly change after a few."""


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


def turn_ratio(
    track: ScanTrack,
    other: WheelTrack,
    config: TurnRatioConfig,
    windows: TurnAgreementConfig,
    expected_lag: int = 0,
) -> TurnRatio | None:
    """The ratio; None where too little was turned, or the turns of both have nothing in common at the usual
    lags and those about the expected one (nanoseconds)."""
    steps, step = round(windows.usual_lag / windows.step), round(windows.step * 1e9)
    about_none = np.arange(-steps, steps + 1)
    lags = np.union1d(about_none, about_none + round(expected_lag / step)).astype(np.int64) * step
    seen = turns_at(track, other, lags, windows)
    if seen.turned < config.min_turn:
        return None
    products = (seen.is_covered * seen.turns * seen.by_other).sum(axis=1)
    sizes = (seen.is_covered * seen.turns**2).sum(axis=1) * (seen.is_covered * seen.by_other**2).sum(axis=1)
    correlations = np.abs(products) / np.maximum(np.sqrt(sizes), 1e-12)
    best = int(np.argmax(correlations))
    if correlations[best] < config.min_correlation or best in (0, len(lags) - 1):
        return None
    chosen = seen.is_covered[best]
    turns, by_other = seen.turns[chosen], seen.by_other[best, chosen]
    blocks = np.arange(len(turns)) // max(round(seen.scans_apart * config.block / windows.window.length), 1)
    count = int(blocks[-1]) + 1
    if count < config.min_blocks:
        return None
    value, weights = _slope(by_other, turns)
    parts = np.stack(
        [
            np.bincount(blocks, weights * by_other * turns, count),
            np.bincount(blocks, weights * by_other**2, count),
        ]
    )
    draws = np.random.default_rng(0).multinomial(count, np.full(count, 1.0 / count), config.resamplings)
    above, below = parts @ draws.T
    sigma = float(np.std(above / np.maximum(below, 1e-12)))
    lag = int(lags[best])
    expected = nearer_to(lag, expected_lag)
    shown = shown_lag(track, seen, lags, (lag, expected), value, windows)
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
