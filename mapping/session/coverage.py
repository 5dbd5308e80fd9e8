"""Coarse coverage of the floor, to decide which keyframes show more than others."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.mapping.grid.rendering import Rays, bounds_of, touched_by
from racecar.maps.geometry.se2 import Pose

_CELL = 0.25
"""Metres of a cell, since narrower spots are irrelevant to a car."""


def showing_more(rays: Sequence[Rays], map_from_laser: Pose, is_kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(K,) kept keyframes, with rays (K) at poses (K, 3), plus those of the others, from last to first, that
    show something none of these does."""
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
    """Number of cells (rows, columns) that a scan touches and that were not ``seen``; marks them as seen.

    ``touched`` (N + 1, 2), fractional column and row, are the ends of its rays, then their start. Rays are
    sampled every half cell at most, so that few cells cut at a corner are missed.
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
