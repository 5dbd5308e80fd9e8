"""The loop over places, headings and beams of the search."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def fill_scores(
    views: NDArray[np.uint8],
    view_of_place: NDArray[np.int64],
    offsets: NDArray[np.int64],
    log_probabilities: NDArray[np.float32],
    scores: NDArray[np.float32],
) -> None:
    """Fill scores (places, headings / 2): the log-likelihood of a scan at each place and second heading.

    ``views`` (N, headings) hold codes of ranges, ``offsets`` (B,) the bearings of the beams in headings.
    """
    headings = views.shape[1]
    around = np.empty(2 * headings, dtype=np.uint8)
    for place in range(len(view_of_place)):
        around[:headings] = views[view_of_place[place]]
        around[headings:] = around[:headings]
        for half in range(headings // 2):
            total = np.float32(0.0)
            for beam in range(len(offsets)):
                total += log_probabilities[beam, around[2 * half + offsets[beam]]]
            scores[place, half] = total


@njit(cache=True, nogil=True)
def compare_views(views: NDArray[np.float32], alike: float, alike_share: float) -> NDArray[np.float64]:
    """(P * (P - 1), 3) shares of the beams of one view that agree, are shorter, are longer than another's.

    The other of views (P, headings) is turned as fits best. Readings agree within ``alike`` and a share of
    the range.
    """
    places, headings = views.shape
    shares = np.zeros((places * (places - 1), 3))
    pair = 0
    for seen in range(places):
        for taken in range(places):
            if seen == taken:
                continue
            for turn in range(0, headings, 4):
                agreeing, shorter = 0, 0
                for heading in range(0, headings, 4):
                    expected = views[taken, (heading + turn) % headings]
                    within = alike + alike_share * expected
                    measured = views[seen, heading]
                    if measured < expected - within:
                        shorter += 1
                    elif measured <= expected + within:
                        agreeing += 1
                share = agreeing / (headings // 4)
                if share > shares[pair, 0]:
                    shares[pair, 0], shares[pair, 1] = share, shorter / (headings // 4)
            shares[pair, 2] = 1.0 - shares[pair, 0] - shares[pair, 1]
            pair += 1
    return shares
