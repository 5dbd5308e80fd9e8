"""The points of a cloud that stand upright: walls, posts, furniture; neither floors nor ceilings."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.odometry.config import UprightConfig


def upright_points(points: NDArray[np.float64], config: UprightConfig) -> NDArray[np.float64]:
    """Those of points (N, 3), in metres with z up, that have others well below and well above them.

    The rows of a spinning sensor draw rings on floors and ceilings that move along with it, so points matched
    to their nearest neighbours there suggest that the sensor stands still. In a column of space a floor and
    a ceiling show as two heights, far apart; what stands upright shows as many.
    """
    column = np.floor(points[:, :2] / config.column)
    order = np.lexsort((points[:, 2], column[:, 1], column[:, 0]))
    column, height = column[order], points[order, 2]
    is_start = np.ones(len(points), dtype=np.bool_)
    is_start[1:] = (np.diff(column, axis=0) != 0).any(axis=1) | (np.diff(height) > config.max_gap)
    starts = np.flatnonzero(is_start)
    lengths = np.diff(starts, append=len(points))
    lowest, highest = np.repeat(height[starts], lengths), np.repeat(height[starts + lengths - 1], lengths)
    stands = (height > lowest + config.margin) & (height < highest - config.margin)
    upright: NDArray[np.float64] = points[order[stands]]
    return upright
