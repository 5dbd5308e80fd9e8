"""Outlines of shapes: the car's body, ellipses, crosses, arrows."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points

_BODY = np.array([[-0.1, -0.15], [0.4, -0.15], [0.5, 0.0], [0.4, 0.15], [-0.1, 0.15], [-0.1, -0.15]])
"""Metres, relative to ``base_link``: the body of a car at a tenth of full size, with a pointed nose."""

_BARB = np.array([[np.cos(0.45), -np.sin(0.45)], [np.sin(0.45), np.cos(0.45)]])
"""Rotation from a shaft to a barb: 0.45 rad, as is usual for arrows."""


def car_outline(map_from_base: Pose, scale: float = 1.0) -> NDArray[np.float64]:
    """(6, 2) corners of a car at a pose (3,)."""
    return transform_points(map_from_base, scale * _BODY)


def ellipse(mean: NDArray[np.float64], covariance: NDArray[np.float64], sigmas: float) -> NDArray[np.float64]:
    """(49, 2) points of the ellipse at ``sigmas`` standard deviations from a mean (2,), covariance (2, 2)."""
    variances, axes = np.linalg.eigh(covariance)
    angles = np.linspace(0.0, 2.0 * np.pi, 49)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    points: NDArray[np.float64] = mean + sigmas * (circle * np.sqrt(np.maximum(variances, 0.0))) @ axes.T
    return points


def cross(place: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """(2, 2, 2) two strokes through a place (2,)."""
    arms = size * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]]) / 2.0
    strokes: NDArray[np.float64] = place + arms
    return strokes


def arrow(start: NDArray[np.float64], end: NDArray[np.float64], head: float) -> NDArray[np.float64]:
    """(3, 2, 2) a shaft from one place (2,) to another, and two barbs of length ``head``, at most that of the
    shaft."""
    shaft = end - start
    length = max(float(np.hypot(*shaft)), 1e-9)
    back = -shaft * min(head / length, 1.0)
    barbs = [[end, end + _BARB @ back], [end, end + _BARB.T @ back]]
    strokes: NDArray[np.float64] = np.array([[start, end], *barbs])
    return strokes
