"""The loop over places, headings and points of the place search."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def score_places(
    places: NDArray[np.int32],
    turned_points: NDArray[np.int32],
    codes: NDArray[np.uint8],
    log_by_code: NDArray[np.float32],
    scores: NDArray[np.float32],
) -> None:
    """Fill scores (places, headings) with the sum over points of what their codes add.

    ``places`` (N, 2) are rows and columns of ``codes``, ``turned_points`` (headings, P, 2) rows and columns
    from there.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    for n in range(len(places)):
        row, column = places[n]
        for heading in range(len(turned_points)):
            total = np.float32(0.0)
            for k in range(turned_points.shape[1]):
                r = min(max(row + turned_points[heading, k, 0], 0), last_row)
                c = min(max(column + turned_points[heading, k, 1], 0), last_column)
                total += log_by_code[codes[r, c]]
            scores[n, heading] = total
