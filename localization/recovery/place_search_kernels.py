"""Loops over positions, headings and points of the place search."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def turned_points(points: NDArray[np.float64], headings: int, far: int) -> NDArray[np.int32]:
    """(headings, P, 2) rows and columns, clipped at ``far``, of points (P, 2) rotated to all headings."""
    turned = np.empty((headings, len(points), 2), dtype=np.int32)
    for heading in range(headings):
        angle = 2.0 * math.pi * heading / headings
        cos, sin = math.cos(angle), math.sin(angle)
        for k in range(len(points)):
            x, y = points[k]
            turned[heading, k, 0] = min(max(round(sin * x + cos * y), -far), far)
            turned[heading, k, 1] = min(max(round(cos * x - sin * y), -far), far)
    return turned


@njit(cache=True, nogil=True)
def score_places(
    places: NDArray[np.int32],
    turned_points: NDArray[np.int32],
    codes: NDArray[np.uint8],
    log_by_code: NDArray[np.float32],
    scores: NDArray[np.float32],
) -> None:
    """Fill scores (places, headings) with sums over points of the log-likelihood of their codes.

    ``places`` (N, 2) are rows and columns in ``codes``; ``turned_points`` (headings, P, 2) are relative to
    them.
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


@njit(cache=True, nogil=True)
def best_places(
    places: NDArray[np.int32],
    turned_points: NDArray[np.int32],
    codes: NDArray[np.uint8],
    log_by_code: NDArray[np.float32],
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (M,) of up to ``most`` places with the highest sums, in descending order, and of headings.

    The same sums as above, abandoned once they fall behind, as no code adds more than zero.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    best = np.full(most, -np.inf, dtype=np.float32)
    place, turn = np.zeros(most, dtype=np.int64), np.zeros(most, dtype=np.int64)
    for n in range(len(places)):
        row, column = places[n]
        highest, at = best[-1], -1
        for heading in range(len(turned_points)):
            total = np.float32(0.0)
            for k in range(turned_points.shape[1]):
                r = min(max(row + turned_points[heading, k, 0], 0), last_row)
                c = min(max(column + turned_points[heading, k, 1], 0), last_column)
                total += log_by_code[codes[r, c]]
                if total <= highest:
                    break
            if total > highest:
                highest, at = total, heading
        if at >= 0:
            rank = np.searchsorted(-best, -highest)
            for later in range(most - 1, rank, -1):
                best[later], place[later], turn[later] = best[later - 1], place[later - 1], turn[later - 1]
            best[rank], place[rank], turn[rank] = highest, n, at
    found = np.count_nonzero(best > -np.inf)
    return place[:found], turn[:found]
