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
