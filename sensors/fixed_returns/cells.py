"""Pool votes on single returns in cells of bearing and range."""

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.scan import Scan

_ANGLE = 0.05
"""Radians of a cell. Chosen by judgement: a few beams of a coarse laser."""
_RANGE = 0.2
"""Metres of a cell. Chosen by judgement: twice the tolerance of fixed returns."""
_MIN_SHARE = 0.2
"""Share of fixed returns in a cell from which its undecided ones are removed too. Chosen by judgement: one in
five is no coincidence."""


def in_cells(scans: list[Scan], tallies: list[NDArray[np.int8]]) -> list[NDArray[np.bool_]]:
    """For each scan, (N,) which of its beams are fixed returns, given the votes (N,) on them.

    Some returns stay undecided, such as those of a wall along the path or of a standing laser. They count as
    fixed where the votes on others at similar bearing and range say so.
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
    """(N,) cell numbers; 0 where a beam has no return."""
    bearings = np.floor(scan.bearings / _ANGLE).astype(np.int64)
    around = int(np.ceil(2.0 * np.pi / _ANGLE))
    ranges = (np.where(scan.is_return, scan.ranges, 0.0) / _RANGE).astype(np.int64)
    return np.where(scan.is_return, 1 + bearings % around + around * ranges, 0)
