"""The loop over places, headings and beams of the search."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def fill_scores(
    views: NDArray[np.uint8],
    view_of_place: NDArray[np.int64],
    step: int,
    offsets: NDArray[np.int64],
    log_probabilities: NDArray[np.float32],
    scores: NDArray[np.float32],
) -> None:
    """Fill scores (places, tried): the log-likelihood of a scan at each place and every ``step``-th heading.

    ``views`` (N, headings) hold codes of ranges, ``offsets`` (B,) the bearings of the beams in headings;
    ``step`` divides their number.
    """
    tried = views.shape[1] // step
    # Headings that are tried together lie together, and for two turns, so that many are read at a time.
    seen = np.empty((step, 2 * tried), dtype=np.uint8)
    for place in range(len(view_of_place)):
        seen[:, :tried] = views[view_of_place[place]].reshape(tried, step).T
        seen[:, tried:] = seen[:, :tried]
        totals = scores[place]
        totals[:] = 0.0
        for beam in range(len(offsets)):
            log_probability = log_probabilities[beam]
            expected = seen[offsets[beam] % step, offsets[beam] // step :]
            for n in range(tried):
                totals[n] += log_probability[expected[n]]


@njit(cache=True, nogil=True)
def compare_views(
    views: NDArray[np.float32], distance: float, share: float, close: float, fewest_headings: int
) -> NDArray[np.float64]:
    """(P * (P - 1), 4) shares of beams that agree with another view closely, roughly, are shorter, longer.

    The other of views (P, headings) is turned as fits best, by every few headings, so that at least the
    fewest are tried. Readings agree within a distance, in the unit of the views, and a share of the range,
    and closely within a share ``close`` of that.
    """
    places, headings = views.shape
    shares = np.zeros((places * (places - 1), 4))
    step = max(headings // fewest_headings, 1)
    compared = len(range(0, headings, step))
    pair = 0
    for seen in range(places):
        for taken in range(places):
            if seen == taken:
                continue
            most = -1
            for turn in range(0, headings, step):
                closely, agreeing, shorter = 0, 0, 0
                for heading in range(0, headings, step):
                    expected = views[taken, (heading + turn) % headings]
                    within = distance + share * expected
                    off = views[seen, heading] - expected
                    if off < -within:
                        shorter += 1
                    elif off <= within:
                        agreeing += 1
                        if abs(off) <= close * within:
                            closely += 1
                if agreeing > most:
                    most = agreeing
                    shares[pair, 0] = closely
                    shares[pair, 1] = agreeing - closely
                    shares[pair, 2] = shorter
                    shares[pair, 3] = compared - agreeing - shorter
            pair += 1
    shares /= compared
    return shares
