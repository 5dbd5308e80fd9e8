"""Closed lines of points (N, 2) in metres, the last of which is followed by the first."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from racecar.maps.geometry.polyline import lengths_along, resample


def closed(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N + 1, 2) points of a closed line, the first repeated at the end."""
    return np.concatenate([ring, ring[:1]])


def ring_length(ring: NDArray[np.float64]) -> float:
    """Length of a closed line in metres."""
    return float(lengths_along(closed(ring))[-1])


def resampled_ring(ring: NDArray[np.float64], step: float, multiple: int = 1) -> NDArray[np.float64]:
    """Evenly spaced points (M, 2) of a closed line, about ``step`` apart; M is a ``multiple``."""
    return resample(closed(ring), step, multiple)[:-1]


def smoothed_ring(ring: NDArray[np.float64], points: float) -> NDArray[np.float64]:
    """Smooth a closed line by a Gaussian with a standard deviation of ``points`` points."""
    return ring if points == 0.0 else np.asarray(gaussian_filter1d(ring, points, axis=0, mode="wrap"))


def ring_normals(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) unit vectors to the left of a closed line."""
    ahead = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
    normals: NDArray[np.float64] = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.hypot(*ahead.T)[:, None]
    return normals
