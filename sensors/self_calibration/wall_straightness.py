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

from racecar.sensors.scan import Scan

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
_WIDTH = 0.7
"""Radians of a piece of a wall, 40°. Measured on 30 recordings: wider ones are rare, of narrower ones each
errs by 10 %."""
_MIN_BEAMS = 12
"""Beams of a piece at least; by judgement, against noise."""
_MAX_SCANS, _MIN_SCANS = 100, 15
"""That are looked at, for speed, and that must have a wall that tells; by judgement: some seconds of a
drive."""
_MIN_WALLS = 30
"""Pieces that tell, at least; by judgement: two a scan."""
_MAX_SPREAD = 1.35
"""Ratio of the upper and the lower quartile of the factors at most. Measured: 1.05 to 1.25 between walls, 1.4
and more where clutter or bends prevail."""
_MAX_OBLIQUENESS = 3.0
"""Ratio of the longest and the shortest range of a piece at most; by judgement: beyond are corners and
doors."""
_MAX_NOISE = 0.03
"""Metres by which a straight wall may be rough; by judgement: what common lasers err by."""
_MIN_GAIN = 3.0
"""Times as much that the worst factor must leave as the best one; by judgement: else the piece tells
nothing."""


@dataclass(frozen=True)
class WallStraightness:
    """The factor under which walls are straight."""

    factor: float
    """True bearings over those stated."""


def wall_straightness(scans: Sequence[Scan]) -> WallStraightness | None:
    """The factor; None where there are too few walls or these do not agree."""
    chosen = scans[:: 1 + len(scans) // (_MAX_SCANS + 1)]
    return next((found for guess in _GUESSES if (found := _found_from(guess, chosen))), None)


def _found_from(factor: float, scans: Sequence[Scan]) -> WallStraightness | None:
    found = None
    for _ in range(_ROUNDS):
        found = _agreed(_pieces(scans, _WIDTH / factor))
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


def _pieces(scans: Sequence[Scan], width: float) -> list[_Pieces]:
    """Those that are ``width`` radians wide, as stated, by scans of equal beams."""
    by_step: dict[tuple[int, float], list[tuple[int, NDArray[np.float64]]]] = {}
    for number, scan in enumerate(scans):
        step = float(np.median(np.diff(scan.bearings))) if len(scan.bearings) > 1 else 0.0
        beams = round(width / step) + 1 if step > 0.0 else 0
        if _MIN_BEAMS <= beams <= len(scan.ranges):
            ranges = _whole_pieces(scan, beams, step)
            by_step.setdefault((beams, step), []).append((number, ranges))
    return [
        _Pieces(
            step,
            np.concatenate([ranges for _, ranges in parts]),
            np.repeat([number for number, _ in parts], [len(ranges) for _, ranges in parts]),
        )
        for (_, step), parts in by_step.items()
    ]


def _whole_pieces(scan: Scan, beams: int, step: float) -> NDArray[np.float64]:
    """(P, B) ranges of neighbouring beams that all met something, not too aslant."""
    begins = slice(None, None, max(beams // 2, 1))
    ranges = np.lib.stride_tricks.sliding_window_view(scan.ranges, beams)[begins]
    bearings = np.lib.stride_tricks.sliding_window_view(scan.bearings, beams)[begins]
    is_whole = np.isfinite(ranges).all(axis=1)
    is_whole &= np.abs(bearings[:, -1] - bearings[:, 0] - step * (beams - 1)) < 0.5 * step
    ranges = ranges[is_whole]
    chosen: NDArray[np.float64] = ranges[ranges.max(axis=1) < _MAX_OBLIQUENESS * ranges.min(axis=1)]
    return chosen


def _agreed(pieces: Sequence[_Pieces]) -> WallStraightness | None:
    told = [_factors_of(each) for each in pieces]
    if not told:
        return None
    factors = np.concatenate([factors for factors, _ in told])
    scans = np.unique(np.concatenate([scans for _, scans in told]))
    if len(factors) < _MIN_WALLS or len(scans) < _MIN_SCANS:
        return None
    low, middle, high = np.quantile(factors, [0.25, 0.5, 0.75]).tolist()
    is_inside = _FACTORS[0] < low and high < _FACTORS[-1]
    agrees = is_inside and high < _MAX_SPREAD * low
    return WallStraightness(middle) if agrees else None


def _factors_of(pieces: _Pieces) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(T,) the factors of the pieces that tell, and of which scans (T,) they are."""
    left = _metres_left(pieces)
    least = left.min(axis=1)
    is_telling = (least < _MAX_NOISE) & (left.max(axis=1) > _MIN_GAIN * np.maximum(least, _FINEST))
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
