"""By what factor the bearings of the beams must be multiplied for walls to be straight.

On a straight wall the inverse range is a cosine of the bearing, ``1 / r = cos(θ - φ) / d``. Where the
bearings are stated a factor too small it oscillates by that factor faster, so the frequency that explains a
piece of a wall best is the factor. One piece tells it to some per cent, and curved walls tell another; where
most pieces of many scans agree, it is the laser's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.config import WallStraightnessConfig
from racecar.maps.sensing.scan import Scan

_FACTORS = np.exp(np.arange(-60, 61) * 0.02)
"""(F,) that are tried, to 3.3 and its inverse; in steps of 2 %, since a piece of a wall tells no better."""
_GUESSES = (1.0, 2.0)
"""Factors for which pieces are as wide as they should be at first; the second because few walls are wide
enough where angles are stated half."""
_ROUNDS, _CLOSE = 3, 1.05
"""Of looking again, with pieces as wide as the factor found so far makes them, unless it is nearly the one
before, because each piece that is too narrow errs more."""
_FINEST = 0.003
"""Metres to which a wall is straight at best, so that pieces that fit by chance do not count for more."""


@dataclass(frozen=True)
class WallStraightness:
    """The factor under which walls are straight."""

    factor: float
    """True bearings over those stated."""


def wall_straightness(scans: Sequence[Scan], config: WallStraightnessConfig) -> WallStraightness | None:
    """The factor; None where there are too few walls or these do not agree."""
    chosen = scans[:: 1 + len(scans) // (config.max_scans + 1)]
    return next((found for guess in _GUESSES if (found := _found_from(guess, chosen, config))), None)


def _found_from(
    factor: float, scans: Sequence[Scan], config: WallStraightnessConfig
) -> WallStraightness | None:
    found = None
    for _ in range(_ROUNDS):
        found = _agreed(_pieces(scans, config.width / factor, config), config)
        if found is None or max(found.factor / factor, factor / found.factor) < _CLOSE:
            break
        factor = found.factor
    return found


@dataclass(frozen=True, eq=False)
class _Pieces:
    """P pieces of scans, of B beams that are ``step`` radians apart."""

    step: float
    ranges: NDArray[np.float64]
    """(P, B) metres."""
    scan: NDArray[np.int64]
    """(P,) which one each is of."""


def _pieces(scans: Sequence[Scan], width: float, config: WallStraightnessConfig) -> list[_Pieces]:
    """Those that are ``width`` radians wide, as stated, by scans of equal beams."""
    by_step: dict[tuple[int, float], list[tuple[int, NDArray[np.float64]]]] = {}
    for number, scan in enumerate(scans):
        step = float(np.median(np.diff(scan.bearings))) if len(scan.bearings) > 1 else 0.0
        beams = round(width / step) + 1 if step > 0.0 else 0
        if config.min_beams <= beams <= len(scan.ranges):
            ranges = _whole_pieces(scan, beams, step, config)
            by_step.setdefault((beams, step), []).append((number, ranges))
    return [
        _Pieces(
            step,
            np.concatenate([ranges for _, ranges in parts]),
            np.repeat([number for number, _ in parts], [len(ranges) for _, ranges in parts]),
        )
        for (_, step), parts in by_step.items()
    ]


def _whole_pieces(scan: Scan, beams: int, step: float, config: WallStraightnessConfig) -> NDArray[np.float64]:
    """(P, B) ranges of neighbouring beams that all met something, not too aslant."""
    begins = slice(None, None, max(beams // 2, 1))
    ranges = np.lib.stride_tricks.sliding_window_view(scan.ranges, beams)[begins]
    bearings = np.lib.stride_tricks.sliding_window_view(scan.bearings, beams)[begins]
    is_whole = np.isfinite(ranges).all(axis=1)
    is_whole &= np.abs(bearings[:, -1] - bearings[:, 0] - step * (beams - 1)) < 0.5 * step
    ranges = ranges[is_whole]
    chosen: NDArray[np.float64] = ranges[ranges.max(axis=1) < config.max_obliqueness * ranges.min(axis=1)]
    return chosen


def _agreed(pieces: Sequence[_Pieces], config: WallStraightnessConfig) -> WallStraightness | None:
    told = [_factors_of(each, config) for each in pieces]
    if not told:
        return None
    factors = np.concatenate([factors for factors, _ in told])
    scans = np.unique(np.concatenate([scans for _, scans in told]))
    if len(factors) < config.min_walls or len(scans) < config.min_scans:
        return None
    low, middle, high = np.quantile(factors, [0.25, 0.5, 0.75]).tolist()
    is_inside = _FACTORS[0] < low and high < _FACTORS[-1]
    agrees = is_inside and high < config.max_spread * low
    return WallStraightness(middle) if agrees else None


def _factors_of(
    pieces: _Pieces, config: WallStraightnessConfig
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(T,) the factors of the pieces that tell, and of which scans (T,) they are."""
    left = _metres_left(pieces)
    least = left.min(axis=1)
    is_telling = (least < config.max_noise) & (
        left.max(axis=1) > config.min_gain * np.maximum(least, _FINEST)
    )
    return _FACTORS[np.argmin(left[is_telling], axis=1)], pieces.scan[is_telling]


def _metres_left(pieces: _Pieces) -> NDArray[np.float64]:
    """(P, F) by which they deviate from a straight wall with the bearings multiplied by each factor."""
    squares, inverse = pieces.ranges**2, 1.0 / pieces.ranges
    beams = pieces.ranges.shape[1]
    bearings = pieces.step * (np.arange(beams) - 0.5 * (beams - 1))
    left = np.empty((len(inverse), len(_FACTORS)))
    for column, factor in enumerate(_FACTORS):
        basis, _ = np.linalg.qr(np.column_stack([np.cos(factor * bearings), np.sin(factor * bearings)]))
        missed = (inverse - inverse @ basis @ basis.T) * squares  # since dr = r² d(1 / r)
        left[:, column] = np.sqrt(np.mean(missed**2, axis=1))
    return left
