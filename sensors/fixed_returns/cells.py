"""Cells of bearing and range in which returns move along: votes of single returns, put together."""

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.scan import Scan

_ANGLE = 0.05
"""Radians of a cell; by judgement: a few beams of a coarse laser."""
_RANGE = 0.2
"""Metres of a cell; by judgement: twice what is fixed."""
_MIN_SHARE = 0.2
"""Share of a cell's returns that must move along for those that are open to be left out too; by judgement:
one in five is no chance."""


def in_cells(scans: list[Scan], tallies: list[NDArray[np.int8]]) -> list[NDArray[np.bool_]]:
    """For each scan, (N,) which of its beams move along, by the votes (N,) on them.

    Of returns at like bearings and ranges some may be open, as those of a wall that is driven along and those
    of all that is seen while the laser stands. They move along where the votes on the others say so.
    """
    cells = [_cells_of(scan) for scan in scans]
    count = 1 + max(int(cell.max(initial=0)) for cell in cells)
    cell, tally = np.concatenate(cells), np.concatenate(tallies)
    total = np.bincount(cell, minlength=count)
    along = np.bincount(cell[tally > 0], minlength=count)
    world = np.bincount(cell[tally < 0], minlength=count)
    likely = along > world
    proven = likely & (along >= _MIN_SHARE * total)
    proven[0] = likely[0] = False
    return [
        (proven[cell] & (tally == 0)) | (likely[cell] & (tally > 0))
        for cell, tally in zip(cells, tallies, strict=True)
    ]


def _cells_of(scan: Scan) -> NDArray[np.int64]:
    """(N,) numbers of cells; 0 where there is no return."""
    bearings = np.floor(scan.bearings / _ANGLE).astype(np.int64)
    around = int(np.ceil(2.0 * np.pi / _ANGLE))
    ranges = (np.where(scan.is_return, scan.ranges, 0.0) / _RANGE).astype(np.int64)
    return np.where(scan.is_return, 1 + bearings % around + around * ranges, 0)
