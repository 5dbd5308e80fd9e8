"""The middle of the lanes through which a lap was driven."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, minimum_filter1d
from scipy.spatial import cKDTree
from skimage.measure import find_contours

from racecar.maps.errors import UserError
from racecar.maps.geometry.closed_line import ring_normals
from racecar.maps.grid.raster import Raster
from racecar.maps.grid.winding_numbers import winding_numbers

_MOUTH = 3
"""Points of a lap, 0.1 m apart, for which obstacles go on beside it before its middle is followed, since that
bends where another lane opens. Chosen by judgement."""
_OFF = 0.5
"""Metres by which the middle may be farther from a point that was driven than the line that it follows there.
Chosen by judgement: less than from lane to lane."""
_NO_MIDDLE = (
    "No walls divide the lanes of the lap; draw them in edits.yaml, or drive a lap whose lanes do not meet."
)


def middle_line(
    grid: Raster, blocked: NDArray[np.bool_], lap: NDArray[np.float64], is_bounded: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Points (M, 2) in driving order, equally far from the blocked cells (rows, columns) on the left of a lap
    (N, 2) and from those on its right.

    They lie on level lines of the difference of both distances. What is on the left has the lap's winding
    number there, or a greater one. A lap that never crosses itself follows one line all round, which is
    closed and crosses itself nowhere. Where a lap crosses itself, its winding number changes, and it goes
    straight to the next line, from the last point to the first that ``is_bounded`` (N,) on both sides.

    Raises UserError when no obstacles divide the lanes.
    """
    lines, distances, nearest = _lines_beside(grid, blocked, lap)
    is_bounded = is_bounded & np.any(np.isfinite(distances), axis=0)
    kept = np.flatnonzero(minimum_filter1d(is_bounded, 2 * _MOUTH + 1, mode="wrap"))
    if len(kept) == 0:
        raise UserError(_NO_MIDDLE)
    which = distances.argmin(axis=0)
    followed, places = which[kept], nearest[which[kept], kept]
    stretches = np.split(np.arange(len(kept)), 1 + np.flatnonzero(np.diff(followed)))
    if followed[0] == followed[-1]:
        stretches[-1] = np.append(stretches[-1], 0)
    parts = [_part(lines[followed[stretch[0]]], places[stretch]) for stretch in stretches]
    middle = np.concatenate(parts)
    if np.any(cKDTree(middle).query(lap[kept])[0] > distances[which[kept], kept] + _OFF):
        raise UserError(_NO_MIDDLE)
    return middle


def _lines_beside(
    grid: Raster, blocked: NDArray[np.bool_], lap: NDArray[np.float64]
) -> tuple[list[NDArray[np.float64]], NDArray[np.float64], NDArray[np.int64]]:
    """L closed lines (M, 2) in the middle between obstacles on the left and right; (L, N) metres to each from
    the points of the lap (N, 2), inf where a point has other obstacles on its left and right; and (L, N) the
    nearest point of the line."""
    rounds = winding_numbers(grid, lap)
    cells = grid.cell_of(lap + 2.0 * grid.resolution * ring_normals(lap))
    level_driven = rounds[tuple(np.clip(cells, 0, np.array(grid.shape) - 1).T)]
    lines, distances, nearest = [], [], []
    for level in range(rounds.min() + 1, rounds.max() + 1):
        for line in _level_lines(grid, blocked & (rounds >= level), blocked & (rounds < level)):
            away, index = cKDTree(line).query(lap)
            lines.append(line)
            distances.append(np.where(level_driven == level, away, np.inf))
            nearest.append(index)
    shape = len(lines), len(lap)
    return lines, np.reshape(distances, shape), np.reshape(nearest, shape).astype(np.int64)


def _part(line: NDArray[np.float64], passed: NDArray[np.int64]) -> NDArray[np.float64]:
    """Points (M, 2) of a closed line from the first to the last index passed (N,), the last left out."""
    half = len(line) // 2
    steps = int(np.sum((np.diff(passed) + half) % len(line) - half))
    return line.take(np.arange(passed[0], passed[0] + max(1, steps)), axis=0, mode="wrap")


def _level_lines(
    grid: Raster, left: NDArray[np.bool_], right: NDArray[np.bool_]
) -> list[NDArray[np.float64]]:
    """Closed lines (N, 2) in metres in the map, equally far from two sets of cells (rows, columns), with the
    first on their left; none where a set is empty."""
    if not left.any() or not right.any():
        return []
    nearer_left = distance_transform_edt(~right) - distance_transform_edt(~left)
    contours = find_contours(nearer_left, 0.0)
    return [grid.center_of(line[:-1]) for line in contours if np.array_equal(line[0], line[-1])]
