"""What stands upright in a cloud: walls, posts, furniture; neither floors nor ceilings."""

import numpy as np
from numpy.typing import NDArray

_COLUMN = 0.25
_MAX_GAP = 1.5
_MARGIN = 0.1


def upright_points(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Those of points (N, 3), in metres with z up, that have others well below and well above them.

    The rows of a turning sensor draw rings on floors and ceilings that move along with it: points matched
    to their nearest neighbours there speak for standing still. Seen from above a floor under a ceiling
    has two heights, far apart; what stands upright has many.
    """
    column = np.floor(points[:, :2] / _COLUMN)
    order = np.lexsort((points[:, 2], column[:, 1], column[:, 0]))
    column, height = column[order], points[order, 2]
    is_start = np.ones(len(points), dtype=np.bool_)
    is_start[1:] = (np.diff(column, axis=0) != 0).any(axis=1) | (np.diff(height) > _MAX_GAP)
    starts = np.flatnonzero(is_start)
    lengths = np.diff(starts, append=len(points))
    lowest, highest = np.repeat(height[starts], lengths), np.repeat(height[starts + lengths - 1], lengths)
    stands = (height > lowest + _MARGIN) & (height < highest - _MARGIN)
    upright: NDArray[np.float64] = points[order[stands]]
    return upright
