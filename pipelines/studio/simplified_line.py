"""Fewer segments for a line that looks the same: each costs a browser that draws in software 0.1 ms."""

import numpy as np
import shapely
from numpy.typing import NDArray

_SHADES = 50
"""Steps of a colour scale that the eye tells apart along a line. Chosen by judgement."""


def corners_of_line(
    points: NDArray[np.float64], shares: NDArray[np.float64] | None, off: float
) -> NDArray[np.int64]:
    """Indices (K,) of the points (N, 2) to keep for a line that is at most ``off`` metres away: the ends, the
    corners, and where the shade of the segments, ``shares`` (N - 1,) of a colour scale, changes."""
    numbered = shapely.LineString(np.column_stack([points, np.arange(len(points))]))
    corners = shapely.simplify(numbered, off, preserve_topology=False)
    kept: NDArray[np.int64] = shapely.get_coordinates(corners, include_z=True)[:, 2].astype(np.int64)
    if shares is None:
        return kept
    changes = 1 + np.flatnonzero(np.diff(np.rint(_SHADES * shares)))
    both: NDArray[np.int64] = np.union1d(kept, changes)
    return both
