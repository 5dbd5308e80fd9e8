"""The turn between two scans by their ranges over the bearing, whatever the guess was.

Registration that begins more than a few degrees off sticks in a wrong minimum, and lasers of few scans a
second turn by tens of degrees between two of them. Correlating range profiles is the cheapest search that
finds such a turn [Weiss and von Puttkamer, "A map based on laserscans without geometric interpretation",
IAS 1995]; the profile stands still while the laser moves by less than the walls are away.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.self_calibration.profile_turn_kernels import profile_differences

BINS = 360
"""Of a profile, one per degree, since registration mends what is left of the turn."""
_MAX_TURN = 0.8
"""Radians to each side that are searched; by judgement: robots turn on the spot at 2 rad/s, and slow lasers
make five scans a second."""
_MAX_DIFFERENCE = 0.3
"""Difference of the logarithms of two ranges from which they are of different things; by judgement: a third
of the range."""
_MIN_SHARE = 0.5
"""Share of the bearings known in both, of the most of any turn, below which a turn is not judged; by
judgement: at the edge of a narrow field of view few beams agree by chance."""
_MIN_GAIN = 0.8
"""Share of the guess's difference that another turn may leave; by judgement: steady motion is mostly
right."""


def bearing_profile(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(BINS,) logarithm of the nearest range by bearing, of points (N, 2) in the laser frame; NaN where there
    is none."""
    profile = np.full(BINS, np.inf)
    ranges = np.hypot(points[:, 0], points[:, 1])
    bins = np.floor(np.arctan2(points[:, 1], points[:, 0]) * (BINS / (2.0 * np.pi))).astype(np.int64) % BINS
    np.minimum.at(profile, bins, np.maximum(ranges, 1e-3))
    profile[np.isinf(profile)] = np.nan
    logarithms: NDArray[np.float64] = np.log(profile)
    return logarithms


def turn_between(before: NDArray[np.float64], after: NDArray[np.float64], guess: float) -> float:
    """Radians by which the laser has turned between two profiles (BINS,): the guess, unless another turn
    makes them clearly more alike."""
    steps = round(_MAX_TURN * BINS / (2.0 * np.pi))
    costs = profile_differences(before, after, steps, _MAX_DIFFERENCE, _MIN_SHARE)
    best = int(np.argmin(costs))
    guessed = min(max(round(guess * BINS / (2.0 * np.pi)) + steps, 0), 2 * steps)
    if abs(best - guessed) <= 1 or not costs[best] < _MIN_GAIN * costs[guessed]:
        return guess
    return float((best - steps) * (2.0 * np.pi / BINS))
