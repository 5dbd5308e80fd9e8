"""Selects the upright points of a cloud, such as walls, posts and furniture, but not floors or ceilings."""

import numpy as np
from numpy.typing import NDArray

_COLUMN = 0.25
"""Side of the columns in which heights are compared, metres. Chosen by judgement: scan odometry's voxel."""
_MAX_GAP = 1.5
"""Metres of height without a point that separate floor from ceiling. Chosen by judgement: more than the
spacing of a laser's rows on a wall, less than a storey."""
_MARGIN = 0.1
"""Metres above the lowest and below the highest point of a column that may still be floor or ceiling. Chosen
by judgement: noise, and the slope of a floor across a column."""


def upright_points(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The points (N, 3), in metres with z up, that have others well below and well above them.

    The rows of a spinning sensor draw rings on floors and ceilings that move with it. Matching these points
    to their nearest neighbours suggests that the sensor stands still. In a column of space a floor and a
    ceiling show up as two heights, far apart; an upright surface shows up as many.
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
