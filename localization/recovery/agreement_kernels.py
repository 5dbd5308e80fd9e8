"""Comparing a scan with what the map says."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.floor.laser_cell_kernels import laser_cell
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.ray_casting_kernels import cast_one

_CLOSELY, _ROUGHLY, _STOPPED, _LOOKING_THROUGH = range(4)
"""Columns of the counts, by definition in the order of `AgreementShares`."""


@njit(cache=True, nogil=True)
def count_agreeing(
    map_from_base: Pose,
    base_from_laser: Pose,
    grid_in_map: NDArray[np.float64],
    cells: NDArray[np.int8],
    is_open: NDArray[np.bool_],
    bearings: NDArray[np.float64],
    ranges: NDArray[np.float64],
    max_range: float,
    agrees: tuple[float, float, float],
    along: float,
    every: int,
) -> NDArray[np.float64]:
    """(2, 4) how many beams agree closely, roughly, are shorter, are longer; none where the laser cannot be.

    First all of them; then ``every`` so many, without those that agree ``along`` metres ahead and behind as
    well, and by half those that agree at one of the two. ``grid_in_map`` is x, y, cos and sin of the grid's
    origin and cells per metre. A reading ``agrees`` when it is within metres and a share of the range, and
    closely within a share of that.
    """
    counts = np.zeros((2, 4))
    x, y, yaw = map_from_base
    cos, sin = math.cos(yaw), math.sin(yaw)
    here = laser_cell(x, y, cos, sin, base_from_laser, grid_in_map)
    is_on_map = 0 <= here[0] < cells.shape[0] and 0 <= here[1] < cells.shape[1]
    if not is_on_map or not is_open[int(here[0]), int(here[1])]:
        return counts
    ahead = laser_cell(x + along * cos, y + along * sin, cos, sin, base_from_laser, grid_in_map)
    behind = laser_cell(x - along * cos, y - along * sin, cos, sin, base_from_laser, grid_in_map)
    _, _, cos0, sin0, per_metre = grid_in_map
    heading = yaw + base_from_laser[2] - math.atan2(sin0, cos0)
    for beam in range(len(bearings)):
        beam_direction = heading + bearings[beam]
        direction = (math.sin(beam_direction), math.cos(beam_direction))
        measured = min(ranges[beam], max_range)
        kind = _kind(measured, here, direction, cells, per_metre, max_range, agrees)
        counts[0, kind] += 1.0
        if beam % every != 0:
            continue
        if kind > _ROUGHLY:
            counts[1, kind] += 1.0
            continue
        for beside in (ahead, behind):
            if _kind(measured, beside, direction, cells, per_metre, max_range, agrees) > _ROUGHLY:
                counts[1, kind] += 0.5
    return counts


@njit(cache=True, nogil=True, inline="always")
def _kind(
    measured: float,
    place: tuple[float, float],
    direction: tuple[float, float],
    cells: NDArray[np.int8],
    per_metre: float,
    max_range: float,
    agrees: tuple[float, float, float],
) -> int:
    """Whether a reading agrees closely, roughly, is shorter, is longer than the map says from a place."""
    metres, share, close = agrees
    reach = cast_one(cells, place[0], place[1], direction[0], direction[1], max_range * per_metre)
    expected = min(reach / per_metre, max_range)
    within = metres + share * expected
    if measured < expected - within:
        return _STOPPED
    if measured > expected + within:
        return _LOOKING_THROUGH
    return _ROUGHLY if abs(measured - expected) > close * within else _CLOSELY
