"""Comparing a scan with what the map says."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.floor.laser_cell_kernels import laser_cell
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.ray_casting_kernels import cast_one


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
    metres: float,
    share: float,
    close: float,
) -> NDArray[np.float64]:
    """(4,) how many beams agree closely, roughly, are shorter, are longer; none where the laser cannot be.

    ``grid_in_map`` is x, y, cos and sin of the grid's origin and cells per metre. A reading agrees when it is
    within ``metres`` and a share of the range, and closely within a share ``close`` of that.
    """
    counts = np.zeros(4)
    x, y, yaw = map_from_base
    row, column = laser_cell(x, y, math.cos(yaw), math.sin(yaw), base_from_laser, grid_in_map)
    if not (0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]) or not is_open[int(row), int(column)]:
        return counts
    _, _, cos0, sin0, per_metre = grid_in_map
    heading = yaw + base_from_laser[2] - math.atan2(sin0, cos0)
    farthest = max_range * per_metre
    for beam in range(len(bearings)):
        direction = heading + bearings[beam]
        reach = cast_one(cells, row, column, math.sin(direction), math.cos(direction), farthest)
        expected = min(reach / per_metre, max_range)
        measured = min(ranges[beam], max_range)
        within = metres + share * expected
        if measured < expected - within:
            counts[2] += 1.0
        elif measured > expected + within:
            counts[3] += 1.0
        elif abs(measured - expected) > close * within:
            counts[1] += 1.0
        else:
            counts[0] += 1.0
    return counts


@njit(cache=True, nogil=True)
def evidence_against(
    shares: NDArray[np.float64],
    when_tracked: NDArray[np.float64],
    least: NDArray[np.float64],
    log_when_lost: NDArray[np.float64],
    prior: NDArray[np.float64],
    beams: float,
) -> float:
    """Log-odds against a place, by as many beams of which shares (4,) were sorted by how they agree.

    At the right place the shares are ``when_tracked`` (4,), of which none is taken for less than ``least``
    (4,), and at a wrong one they are, by their prior odds (K,), one of those whose logarithms (K, 4) are.
    """
    total = 0.0
    for part in range(4):
        total += max(when_tracked[part], least[part])
    log_tracked = 0.0
    for part in range(4):
        log_tracked += shares[part] * math.log(max(when_tracked[part], least[part]) / total)
    odds = 0.0
    for kind in range(len(prior)):
        log_lost = 0.0
        for part in range(4):
            log_lost += shares[part] * log_when_lost[kind, part]
        odds += prior[kind] * math.exp(beams * (log_lost - log_tracked))
    return math.log(odds)
