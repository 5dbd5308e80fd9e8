"""Whether the beams of a scan were measured in the order in which they are recorded.

Drivers of the RPLIDAR kind turn the array of ranges round, to count counter-clockwise, and leave the
``time_increment`` positive: scans are then skewed twice instead of corrected. Two scans of the same place
that turned differently while they were taken fit best with the right sweep; so pairs of them are matched with
the recorded sweep, a reversed one, and others, each weighed by how much of them fits.

The sweep's duration is not estimated: it is biased towards nought where registration follows a skewed scan.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.scan_matching import match, one_to_one
from racecar.mapping.matching.scan_store import ScanStore, prepare_scan
from racecar.mapping.self_calibration.scan_track import ScanTrack, deskewed, track_of
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.sensing.scan import Scan

_STEP = 0.5
"""Between the scales that are tried, so that three of them span the peak, whose width is about the sweep: a
parabola through them is then fine enough to tell its sign."""
_SCALES: NDArray[np.float64] = np.arange(-3.0, 4.0) * _STEP
"""From -1.5 to 1.5, since a peak at either order needs a neighbour on both sides."""
_REVERSED, _NONE, _RECORDED = (_SCALES.tolist().index(scale) for scale in (-1.0, 0.0, 1.0))
"""Where these are among them, by definition."""
_MAX_APART = 1_600_000_000
"""Nanoseconds between the two scans of a pair, at most, so that they see nearly the same; measured on 51
recordings with the limits below."""
_MAX_PAIRS, _FIRST_PAIRS = 240, 60
"""That are compared, and those from which sensors whose beams are as recorded are recognized; by judgement:
they take a second, and a quarter."""
_MAX_USES = 4
"""Pairs that one scan may be in, so that no scan decides alone; by judgement: a few."""
_MIN_RATE_DIFFERENCE = 0.1
"""Radians per second by which the two scans of a pair must turn differently, since two that turn alike are
skewed alike."""
_BLOCK = 1_000_000_000
"""Nanoseconds of a block of the bootstrap, since pairs within it err together."""
_MIN_BLOCKS = 8
"""Blocks below which nothing is decided, since their spread is not known from fewer."""
_RESAMPLINGS = 200
"""Of the bootstrap; by judgement: they tell a deviation to 5 %."""
_OVER_RECORDED, _OVER_NONE = 2.0, 1.5
"""Standard deviations by which the reversed order must beat the recorded one, and a sweep that takes no time.
Measured: 7 of 7 RPLIDARs, no false alarm in 51 recordings."""
_MAX_SCALE, _MAX_SCALE_SIGMA = -0.6, 0.2
"""The sweep that fits best, as a multiple of the recorded one, above which it is not reversed, and the
deviation of that; measured with the limits above."""


class SweepOrder(Enum):
    """In which order of time the beams come."""

    UNKNOWN = "unknown"
    """Too few turns, or no times: taken as recorded."""
    AS_RECORDED = "as recorded"
    REVERSED = "reversed"


@dataclass(frozen=True)
class SweepFit:
    """How well pairs of scans fit with sweeps of other durations."""

    scale: float
    """The sweep that fits best, as a multiple of the recorded one; negative when reversed."""
    scale_sigma: float
    reversed_over_recorded: float
    """By how many standard deviations the reversed order fits better than the recorded one."""
    reversed_over_none: float
    """The same over a sweep that takes no time."""


def has_sweep_times(scan: Scan) -> bool:
    """Whether there is an order of beams to ask about; points of a cloud bear their times one by one."""
    return scan.cloud is None and bool(np.ptp(scan.time_offsets) > 0.0)


def estimate_sweep_order(track: ScanTrack) -> SweepOrder:
    """The order of the beams in the scans of a ``track``, which was followed with the recorded one.

    Where the first look suggests that it is reversed, the scans are followed again so and looked at again.
    """
    first = _first_look(track)
    if first is None or -_OVER_RECORDED <= first < 0.0:
        return SweepOrder.UNKNOWN
    if first < 0.0:
        return SweepOrder.AS_RECORDED
    fit = fit_sweep(track_of(track.scans, -1.0))
    return SweepOrder.REVERSED if fit is not None and _is_reversed(fit) else SweepOrder.UNKNOWN


def fit_sweep(track: ScanTrack) -> SweepFit | None:
    """Match the pairs of scans that tell most; None where there are too few."""
    scores = _pair_scores(track, _MAX_PAIRS, _SCALES)
    if scores is None:
        return None
    return SweepFit(
        scale=_peak(scores.mean),
        scale_sigma=float(np.std([_peak(one) for one in scores.resampled])),
        reversed_over_recorded=scores.sigmas(_REVERSED, _RECORDED),
        reversed_over_none=scores.sigmas(_REVERSED, _NONE),
    )


@dataclass(frozen=True, eq=False)
class _PairScores:
    """How well pairs fit, on average, with S sweeps."""

    mean: NDArray[np.float64]
    """(S,)"""
    resampled: NDArray[np.float64]
    """(R, S) as it might have been, by the bootstrap."""

    def sigmas(self, better: int, worse: int) -> float:
        """By how many standard deviations one sweep fits better than another."""
        spread = float(np.std(self.resampled[:, better] - self.resampled[:, worse]))
        return float(self.mean[better] - self.mean[worse]) / max(spread, 1e-12)


def _first_look(track: ScanTrack) -> float | None:
    """By how many standard deviations the reversed order fits better than the recorded one."""
    scores = _pair_scores(track, _FIRST_PAIRS, _SCALES[[_REVERSED, _RECORDED]])
    return None if scores is None else scores.sigmas(0, 1)


def _pair_scores(track: ScanTrack, max_pairs: int, scales: NDArray[np.float64]) -> _PairScores | None:
    velocities = track.velocities()
    pairs = _telling_pairs(track, velocities[:, 2], max_pairs)
    blocks = _blocks(track)[pairs[:, 0]]
    if len(np.unique(blocks)) < _MIN_BLOCKS:
        return None
    scores = np.column_stack([_scores(track, velocities, pairs, scale) for scale in scales.tolist()])
    return _bootstrapped(scores, blocks)


def _telling_pairs(track: ScanTrack, turn_rates: NDArray[np.float64], max_pairs: int) -> NDArray[np.int64]:
    """(P, 2) scans of nearly the same time whose turn rates (N,) differ most."""
    later = np.searchsorted(track.stamps, track.stamps + _MAX_APART, side="right")
    counts = later - np.arange(len(track)) - 1
    firsts = np.repeat(np.arange(len(track)), counts)
    seconds = firsts + 1 + np.arange(len(firsts)) - np.repeat(np.cumsum(counts) - counts, counts)
    differences = np.abs(turn_rates[firsts] - turn_rates[seconds])
    is_telling = (differences > _MIN_RATE_DIFFERENCE) & (track.segment[firsts] == track.segment[seconds])
    candidates = np.column_stack([firsts, seconds])[is_telling]
    order = np.argsort(-differences[is_telling], kind="stable")
    blocks = _blocks(track)
    uses, in_block = (
        np.zeros(len(track), dtype=np.int64),
        np.zeros(len(track) and blocks[-1] + 1, dtype=np.int64),
    )
    most_in_block = -(-max_pairs // _MIN_BLOCKS)
    chosen: list[tuple[int, int]] = []
    for first, second in candidates[order].tolist():
        block = blocks[first]
        if max(uses[first], uses[second]) < _MAX_USES and in_block[block] < most_in_block:
            uses[first] += 1
            uses[second] += 1
            in_block[block] += 1
            chosen.append((first, second))
            if len(chosen) == max_pairs:
                break
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)


def _blocks(track: ScanTrack) -> NDArray[np.int64]:
    """(N,) the block of time that each scan is in."""
    blocks: NDArray[np.int64] = (track.stamps - track.stamps[:1]) // _BLOCK
    return blocks


def _scores(
    track: ScanTrack, velocities: Pose, pairs: NDArray[np.int64], scale: float
) -> NDArray[np.float64]:
    """(P,) weight of what fits, per point, of pairs (P, 2) with the sweep scaled."""
    members, rows = np.unique(pairs, return_inverse=True)
    store = ScanStore(len(members))
    for member in members.tolist():
        points = deskewed(track.scans[member], velocities[member], scale)
        store.add(prepare_scan(points))
    guesses = between(track.track_from_laser[pairs[:, 0]], track.track_from_laser[pairs[:, 1]])
    matches = match(guesses, one_to_one(rows.reshape(-1, 2)), store, store)
    points = np.array([len(store.points_of(row)) for row in range(len(members))])
    scores: NDArray[np.float64] = matches.weight / np.maximum(points[rows.reshape(-1, 2)].sum(axis=1), 1)
    return scores


def _bootstrapped(scores: NDArray[np.float64], blocks: NDArray[np.int64]) -> _PairScores:
    """From scores (P, S) of pairs that belong to blocks (P,) of time; blocks are drawn with replacement."""
    _, block_of = np.unique(blocks, return_inverse=True)
    counts = np.bincount(block_of).astype(np.float64)
    sums = np.zeros((len(counts), scores.shape[1]))
    np.add.at(sums, block_of, scores)
    evenly = np.full(len(counts), 1.0 / len(counts))
    draws = np.random.default_rng(0).multinomial(len(counts), evenly, _RESAMPLINGS)
    return _PairScores(sums.sum(axis=0) / counts.sum(), (draws @ sums) / (draws @ counts)[:, None])


def _peak(scores: NDArray[np.float64]) -> float:
    """The scale at which scores (S,) are highest, by a parabola through the three about the highest."""
    best = int(np.argmax(scores))
    if best in (0, len(scores) - 1):
        return float(_SCALES[best])
    left, middle, right = scores[best - 1 : best + 2]
    curvature = left - 2.0 * middle + right
    return float(_SCALES[best] + (0.5 * _STEP * (left - right) / curvature if curvature < 0.0 else 0.0))


def _is_reversed(fit: SweepFit) -> bool:
    return (
        fit.scale < _MAX_SCALE
        and fit.scale_sigma < _MAX_SCALE_SIGMA
        and fit.reversed_over_recorded > _OVER_RECORDED
        and fit.reversed_over_none > _OVER_NONE
    )
