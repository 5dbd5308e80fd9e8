"""Fit lines through neighbouring returns of a scan to estimate normals."""

import math
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.sensors.scan import FARTHEST_APART

_HALF_ANGLE = math.radians(3.0)
"""Radians of bearing to each side of a return that its line spans. Measured: a prototype took three beams to
each side at one degree between beams, six at half a degree."""
_HALF_WIDTH = 0.12
"""Metres to each side that a line spans at least, eight times the usual noise, because at close range the
angle spans less."""
_MIN_GAP = 0.15
"""Metres within which two returns always lie on one surface. Chosen by judgement: ten times the usual noise,
less than a doorway."""
_MAX_RMS = 0.04
"""Root mean square distance of returns from their line, in metres, above which the surface is not straight.
Chosen by judgement: noise of 3 cm, as of cheap lasers, still passes."""
_MAX_ASPECT = 0.05
"""Ratio of the variances across and along a line above which its direction is too noisy and it is refitted to
more returns. Chosen by judgement: the normal of six returns then errs by five degrees. Without refitting, 3
cm of noise put aces 1.4 m wrong; with it, it cost 4 % (tests/simulated/test_altered_logs.py)."""
_ATTEMPTS, _WIDENING = 4, 1.5
"""Number of fits, and the factor by which the line grows each time. Chosen by judgement: the fourth line
spans 3.4 times as much as the first."""
_MIN_POINTS = 4
"""Minimum number of returns of a line, because two always lie on one and three hardly show the noise."""
_USUAL_NOISE = 0.015
"""Metres, usual standard deviation of a range. Returns that scatter more are moved towards their line (Wiener
filter). Chosen by judgement: precise scans, of 2 mm, must stay as measured."""

_Points: TypeAlias = NDArray[np.float32]


@njit(cache=True, nogil=True)
def _neighbours(
    points: _Points, i: int, reach: float, max_gap: float
) -> tuple[int, float, float, float, float, float]:
    """Count of the points around point ``i``, their mean (x, y) relative to it and covariance (xx, xy, yy).

    On each side they are taken up to ``reach``, at least two, and not across a jump to another surface.
    """
    count = 1
    sx = sy = sxx = sxy = syy = 0.0
    for direction in (-1, 1):
        last_x = last_y = 0.0
        taken = 0
        j = i + direction
        while 0 <= j < len(points):
            x, y = np.float64(points[j, 0] - points[i, 0]), np.float64(points[j, 1] - points[i, 1])
            if (x - last_x) ** 2 + (y - last_y) ** 2 > max_gap * max_gap:
                break
            if taken >= 2 and x * x + y * y > reach * reach:
                break
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
            last_x, last_y = x, y
            taken += 1
            j += direction
        count += taken
    mx, my = sx / count, sy / count
    return count, mx, my, sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my


@njit(cache=True, nogil=True)
def fit_lines(points: _Points, on_lines: _Points, normals: _Points) -> None:
    """Fit lines through points (N, 2) sorted by bearing, and through more neighbours where noise hides the
    direction.

    ``on_lines`` (N, 2) are the points moved towards their lines: all the way where they scatter far more than
    the usual noise, hardly where less. ``normals`` (N, 2) point to the sensor; where a surface is not
    straight, normals are (0, 0) and points stay. A point at either end, or at the seam behind the sensor
    where bearings wrap, has neighbours on one side only.
    """
    for i in range(len(points)):
        for axis in range(2):
            on_lines[i, axis] = points[i, axis]
            normals[i, axis] = 0.0
        px, py = np.float64(points[i, 0]), np.float64(points[i, 1])
        distance = np.sqrt(px * px + py * py)
        max_gap = max(_MIN_GAP, distance * FARTHEST_APART)
        reach = max(_HALF_WIDTH, distance * _HALF_ANGLE)
        for _ in range(_ATTEMPTS):
            count, mx, my, cxx, cxy, cyy = _neighbours(points, i, reach, max_gap)
            mean, half = 0.5 * (cxx + cyy), 0.5 * (cxx - cyy)
            root = np.sqrt(half * half + cxy * cxy)
            small, large = max(mean - root, 0.0), mean + root
            if count < _MIN_POINTS or small > _MAX_RMS * _MAX_RMS:
                break
            if small > _MAX_ASPECT * large:
                reach *= _WIDENING
                continue
            angle = 0.5 * np.arctan2(2.0 * cxy, cxx - cyy) + 0.5 * np.pi
            nx, ny = np.cos(angle), np.sin(angle)
            if nx * px + ny * py > 0.0:
                nx, ny = -nx, -ny
            off = (nx * mx + ny * my) * small / (small + _USUAL_NOISE * _USUAL_NOISE)
            on_lines[i, 0], on_lines[i, 1] = px + off * nx, py + off * ny
            normals[i, 0], normals[i, 1] = nx, ny
            break
