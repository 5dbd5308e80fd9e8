"""What keyframes show of the floor, coarsely, to tell which of them show more than others."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.mapping.grid.rendering import Rays, bounds_of, touched_by
from racecar.maps.geometry.se2 import Pose

_CELL = 0.25
"""Metres, since what is narrower is no place that a car could miss."""


def showing_more(rays: Sequence[Rays], map_from_laser: Pose, is_kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(K,) those of rays (K) seen from poses (K, 3) that are kept, and of the others, from the last to the
    first, those that show something which none of these does."""
    bounds = bounds_of(rays, map_from_laser)
    low = bounds[:, 0].min(axis=0) - _CELL
    columns, rows = (np.ceil((bounds[:, 1].max(axis=0) - low) / _CELL).astype(np.int64) + 1).tolist()
    seen = np.zeros((rows, columns), dtype=np.bool_)

    def newly_seen(k: int) -> int:
        return int(_look((touched_by(rays[k], map_from_laser[k]) - low) / _CELL, seen))

    chosen = is_kept.copy()
    for k in np.flatnonzero(is_kept).tolist():
        newly_seen(k)
    for k in np.flatnonzero(~is_kept)[::-1].tolist():
        chosen[k] = rays[k].are_kept and newly_seen(k) > 0
    return chosen


@njit(cache=True, nogil=True)
def _look(touched: NDArray[np.float64], seen: NDArray[np.bool_]) -> int:
    """How many cells (rows, columns) a scan touches that were not ``seen``; now they are.

    ``touched`` (N + 1, 2), column and row in fractions of cells, are the ends of its rays and their start.
    Rays are followed in steps of half a cell at most, so that few cells are missed that they cut at a corner.
    """
    column, row = touched[-1]
    unseen = 0
    for i in range(len(touched)):
        dx, dy = touched[i, 0] - column, touched[i, 1] - row
        steps = int(2.0 * max(abs(dx), abs(dy))) + 1
        for step in range(steps + 1):
            share = step / steps
            r, c = int(row + share * dy), int(column + share * dx)
            if not seen[r, c]:
                seen[r, c] = True
                unseen += 1
    return unseen
