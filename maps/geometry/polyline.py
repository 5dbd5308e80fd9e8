"""Lengths along polylines, and evenly spaced points on them."""

import numpy as np
from numpy.typing import NDArray


def lengths_along(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) metres from the first point to each of points (N, 2)."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def resample(points: NDArray[np.float64], step: float, multiple: int = 1) -> NDArray[np.float64]:
    """Points (M, 2) about ``step`` apart along the polyline through points (N, 2), including its ends; their
    number less one is a ``multiple``."""
    along = lengths_along(points)
    keep = np.concatenate([[True], np.diff(along) > 0])
    steps = multiple * max(1, round(along[-1] / step / multiple))
    evenly = np.linspace(0.0, along[-1], steps + 1)
    return np.column_stack([np.interp(evenly, along[keep], points[keep, axis]) for axis in (0, 1)])
