"""Estimate the bearing scale that makes walls straight.

On a straight wall the inverse range is a cosine of the bearing, ``1 / r = cos(θ - φ) / d``. If bearings are
stated too small by a factor, it oscillates faster by that factor, so the best-fitting frequency is the
factor. One piece of wall shows it to some per cent, and curved walls show another. Where most pieces in many
scans agree, it is the laser's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.scan import Scan

_FACTORS = np.exp(np.arange(-60, 61) * 0.02)
"""(F,) candidate factors, to 3.3 and its inverse, in 2 % steps, since a wall is no more accurate."""
_GUESSES = (1.0, 2.0)
"""Initial factors for the width of pieces; the second because few walls are wide enough where angles are
stated half."""
_ROUNDS, _CLOSE = 3, 1.05
"""Rounds with pieces resized by the last factor, and the change at which they end, because narrow pieces err
more."""
_FINEST = 0.003
"""Metres, lower bound of a wall's straightness, so that lucky fits do not dominate."""
_WIDTH = 0.7
"""Radians of a piece of wall, 40°. Measured on 30 recordings: wider ones are rare, of narrower ones each errs
by 10 %."""
_MIN_BEAMS = 12
"""Minimum number of beams of a piece. Chosen by judgement, against noise."""
_MAX_SCANS, _MIN_SCANS = 100, 15
"""Maximum number of scans, for speed, and minimum number with a usable wall. Chosen by judgement: some
seconds of a drive."""
_MIN_WALLS = 30
"""Minimum number of usable pieces. Chosen by judgement: two a scan."""
_MAX_SPREAD = 1.35
"""Maximum ratio of the upper and lower quartiles of the factors. Measured: 1.05 to 1.25 between walls, 1.4
and more where clutter or bends prevail."""
_MAX_OBLIQUENESS = 3.0
"""Maximum ratio of the longest and shortest range of a piece. Chosen by judgement: beyond are corners and
doors."""
_MAX_NOISE = 0.03
"""Metres of roughness of a straight wall at most. Chosen by judgement: the error of common lasers."""
_MIN_GAIN = 3.0
"""Residual ratio of the worst and the best factor that a usable piece needs. Chosen by judgement: else it
shows nothing."""


@dataclass(frozen=True)
class WallStraightness:
    """The bearing scale that makes walls straight."""

    factor: float
    """True bearings relative to stated ones."""


def wall_straightness(scans: Sequence[Scan]) -> WallStraightness | None:
    """Estimate the factor; None where walls are too few or disagree."""
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
    """P pieces of scans with B beams, ``step`` radians apart."""

    step: float
    ranges: NDArray[np.float64]
    """(P, B) metres."""
    scan: NDArray[np.int64]
    """(P,) index of the scan of each."""


def _pieces(scans: Sequence[Scan], width: float) -> list[_Pieces]:
    """Pieces of ``width`` stated radians, grouped by scans with equal beams."""
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
    """(P, B) ranges of consecutive beams that all hit something, not too obliquely."""
    begins = slice(None, None, max(beams // 2, 1))
    ranges = np.lib.stride_tricks.sliding_window_view(scan.ranges, beams)[begins]
    bearings = np.lib.stride_tricks.sliding_window_view(scan.bearings, beams)[begins]
    is_whole = np.isfinite(ranges).all(axis=1)
    is_whole &= np.abs(bearings[:, -1] - bearings[:, 0] - step * (beams - 1)) < 0.5 * step
    ranges = ranges[is_whole]
    chosen: NDArray[np.float64] = ranges[ranges.max(axis=1) < _MAX_OBLIQUENESS * ranges.min(axis=1)]
    return chosen


def _agreed(pieces: Sequence[_Pieces]) -> WallStraightness | None:
    estimates = [_factors_of(each) for each in pieces]
    if not estimates:
        return None
    factors = np.concatenate([factors for factors, _ in estimates])
    scans = np.unique(np.concatenate([scans for _, scans in estimates]))
    if len(factors) < _MIN_WALLS or len(scans) < _MIN_SCANS:
        return None
    low, middle, high = np.quantile(factors, [0.25, 0.5, 0.75]).tolist()
    is_inside = _FACTORS[0] < low and high < _FACTORS[-1]
    agrees = is_inside and high < _MAX_SPREAD * low
    return WallStraightness(middle) if agrees else None


def _factors_of(pieces: _Pieces) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(T,) factors of usable pieces, and the scans (T,) they come from."""
    left = _metres_left(pieces)
    least = left.min(axis=1)
    is_telling = (least < _MAX_NOISE) & (left.max(axis=1) > _MIN_GAIN * np.maximum(least, _FINEST))
    return _FACTORS[np.argmin(left[is_telling], axis=1)], pieces.scan[is_telling]


def _metres_left(pieces: _Pieces) -> NDArray[np.float64]:
    """(P, F) deviation from a straight wall in metres, for bearings multiplied by each factor."""
    squares, inverse = pieces.ranges**2, 1.0 / pieces.ranges
    beams = pieces.ranges.shape[1]
    bearings = pieces.step * (np.arange(beams) - 0.5 * (beams - 1))
    left = np.empty((len(inverse), len(_FACTORS)))
    for column, factor in enumerate(_FACTORS):
        basis, _ = np.linalg.qr(np.column_stack([np.cos(factor * bearings), np.sin(factor * bearings)]))
        missed = (inverse - inverse @ basis @ basis.T) * squares  # since dr = r² d(1 / r)
        left[:, column] = np.sqrt(np.mean(missed**2, axis=1))
    return left
