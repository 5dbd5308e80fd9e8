"""Cells of bearing and range in which returns move along: votes of single returns, put together."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.moving_along.config import MovingAlongConfig
from racecar.maps.sensing.scan import Scan


def in_cells(
    scans: list[Scan], tallies: list[NDArray[np.int8]], config: MovingAlongConfig
) -> list[NDArray[np.bool_]]:
    """For each scan, (N,) which of its beams move along, by the votes (N,) on them.

    Of returns at like bearings and ranges some may be open, as those of a wall that is driven along and those
    of all that is seen while the laser stands. They move along where the votes on the others say so.
    """
    cells = [_cells_of(scan, config) for scan in scans]
    count = 1 + max(int(cell.max(initial=0)) for cell in cells)
    cell, tally = np.concatenate(cells), np.concatenate(tallies)
    total = np.bincount(cell, minlength=count)
    along = np.bincount(cell[tally > 0], minlength=count)
    world = np.bincount(cell[tally < 0], minlength=count)
    likely = along > world
    proven = likely & (along >= config.min_cell_share * total)
    proven[0] = likely[0] = False
    return [
        (proven[cell] & (tally == 0)) | (likely[cell] & (tally > 0))
        for cell, tally in zip(cells, tallies, strict=True)
    ]


def _cells_of(scan: Scan, config: MovingAlongConfig) -> NDArray[np.int64]:
    """(N,) numbers of cells; 0 where there is no return."""
    bearings = np.floor(scan.bearings / config.cell_angle).astype(np.int64)
    around = int(np.ceil(2.0 * np.pi / config.cell_angle))
    ranges = (np.where(scan.is_return, scan.ranges, 0.0) / config.cell_range).astype(np.int64)
    return np.where(scan.is_return, 1 + bearings % around + around * ranges, 0)
