"""Estimate the rotation between two scans from their range profiles, independent of the initial guess.

Registration that starts more than a few degrees off gets stuck in a local minimum, and slow lasers turn tens
of degrees between scans. Correlating range profiles is the cheapest search for such a rotation [Weiss and von
Puttkamer, "A map based on laserscans without geometric interpretation", IAS 1995]. Profiles hardly change
while the laser moves by less than the distance to the walls.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

BINS = 360
"""Bins of a profile, one per degree, since registration corrects the rest."""
_MAX_TURN = 0.8
"""Radians to each side that are searched. Chosen by judgement: robots turn on the spot at 2 rad/s, and slow
lasers make five scans a second."""
_MAX_DIFFERENCE = 0.3
"""Difference of log ranges from which they belong to different objects. Chosen by judgement: a third of the
range."""
_MIN_SHARE = 0.5
"""Share of bearings known in both profiles, relative to the most at any rotation, below which a rotation is
skipped. Chosen by judgement: at the edge of a narrow view, few beams may agree by chance."""
_MIN_GAIN = 0.8
"""Share of the guess's difference that another rotation may leave. Chosen by judgement: steady motion is
mostly right."""


def bearing_profile(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(BINS,) log of the nearest range per bearing of points (N, 2) in the laser frame; NaN for empty
    bins."""
    profile = np.full(BINS, np.inf)
    ranges = np.hypot(points[:, 0], points[:, 1])
    bins = np.floor(np.arctan2(points[:, 1], points[:, 0]) * (BINS / (2.0 * np.pi))).astype(np.int64) % BINS
    np.minimum.at(profile, bins, np.maximum(ranges, 1e-3))
    profile[np.isinf(profile)] = np.nan
    logarithms: NDArray[np.float64] = np.log(profile)
    return logarithms


def turn_between(before: NDArray[np.float64], after: NDArray[np.float64], guess: float) -> float:
    """Rotation in radians between two profiles (BINS,): the guess, unless another makes them clearly more
    alike."""
    steps = round(_MAX_TURN * BINS / (2.0 * np.pi))
    costs = profile_differences(before, after, steps, _MAX_DIFFERENCE, _MIN_SHARE)
    best = int(np.argmin(costs))
    guessed = min(max(round(guess * BINS / (2.0 * np.pi)) + steps, 0), 2 * steps)
    if abs(best - guessed) <= 1 or not costs[best] < _MIN_GAIN * costs[guessed]:
        return guess
    return float((best - steps) * (2.0 * np.pi / BINS))


@njit(cache=True, nogil=True)
def profile_differences(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    steps: int,
    max_difference: float,
    min_share: float,
) -> NDArray[np.float64]:
    """(2 steps + 1,) mean difference of two cyclic profiles (B,), clipped at ``max_difference``, with the
    later one shifted by -steps to steps bins. inf where the bins known in both are fewer than ``min_share``
    of the most at any shift."""
    bins = len(before)
    sums, counts = np.zeros(2 * steps + 1), np.zeros(2 * steps + 1)
    for index in range(2 * steps + 1):
        shift = index - steps
        for bin_ in range(bins):
            difference = abs(after[(bin_ - shift) % bins] - before[bin_])
            if difference == difference:  # neither is NaN
                sums[index] += min(difference, max_difference)
                counts[index] += 1.0
    least = max(min_share * counts.max(), 1.0)
    for index in range(2 * steps + 1):
        sums[index] = sums[index] / counts[index] if counts[index] >= least else np.inf
    return sums
