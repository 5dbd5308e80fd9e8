"""How well particles explain a scan: expected ranges from the table, probabilities from the sensor model."""

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams
from localization.range_table import RangeTable
from localization.sensor_model import beam_log_probabilities
from localization.weighing_kernels import add_up_beams
from maps.se2 import Pose

_TURN = 2.0**32
"""A full turn in the kernel's whole numbers, which wrap around by themselves."""


def scan_log_likelihood(
    map_from_base: Pose, beams: Beams, table: RangeTable, squash: float
) -> NDArray[np.float64]:
    """(N,) log-likelihood of a scan, to the power 1/squash, for each of the particles (N, 3).

    A particle where the car cannot be gets what the least likely readings would give.
    """
    grid = table.free_space.grid
    log_probabilities = beam_log_probabilities(beams.ranges, beams.max_range, grid.resolution, squash)
    bearings = _whole_numbers(beams.bearings + beams.base_from_laser[2] - grid.map_from_grid[2])
    x, y, yaw = grid.map_from_grid
    log_likelihood: NDArray[np.float64] = add_up_beams(
        map_from_base,
        beams.base_from_laser[:2].copy(),  # one that is read-only would be compiled for anew
        np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 / grid.resolution]),
        table.cell_index,
        table.ranges,
        bearings,
        log_probabilities,
        float(log_probabilities.min(axis=1).sum()),
    )
    return log_likelihood


def _whole_numbers(angles: NDArray[np.float64]) -> NDArray[np.uint32]:
    turns = angles / (2.0 * np.pi)
    return ((turns - np.floor(turns)) * _TURN).astype(np.uint64).astype(np.uint32)
