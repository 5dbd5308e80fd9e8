"""Compares a scan with the exact scans of many places at every heading."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def best_agreement(
    views: NDArray[np.float32],
    scan: NDArray[np.float32],
    offsets: NDArray[np.float64],
    distance: float,
    share: float,
) -> NDArray[np.float64]:
    """(P, 2) largest share of a scan's beams that agree with each view (headings,), and the heading of that.

    ``offsets`` (B,) are the bearings of the beams, in units of headings. Ranges agree within a distance in
    metres and a share of the range.
    """
    places, headings = views.shape
    whole = np.floor(offsets + 0.5).astype(np.int64) % headings
    around = np.empty(2 * headings, dtype=np.float32)
    best = np.zeros((places, 2))
    for place in range(places):
        around[:headings] = views[place]
        around[headings:] = views[place]
        for heading in range(headings):
            agreeing = 0
            for beam in range(len(scan)):
                seen = around[heading + whole[beam]]
                if abs(seen - scan[beam]) < distance + share * scan[beam]:
                    agreeing += 1
            if agreeing > best[place, 0]:
                best[place, 0], best[place, 1] = agreeing, heading
    best[:, 0] /= len(scan)
    return best
