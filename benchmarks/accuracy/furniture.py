"""A building whose furniture has moved since its map was made."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OCCUPIED_FROM, OccupancyGrid

_LARGEST_PIECE = 3.0
"""Metres; longer pieces are walls."""
_MOVED_SHARE = 0.5
"""Share of the pieces."""
_SHORTEST_MOVE, _LONGEST_MOVE = 0.3, 1.5
"""Metres. Chosen by judgement: far enough that a scan no longer fits, near enough to stay in the room."""
_TRIES = 50
"""Attempts per piece; one without room around it stays where it is."""


def move_furniture(grid: OccupancyGrid, rng: np.random.Generator) -> OccupancyGrid:
    """The grid with half of its furniture moved by 0.3 to 1.5 m to where there is room.

    Furniture stands free of the walls and is at most 3 m long.
    """
    is_occupied = grid.cells >= OCCUPIED_FROM
    pieces, _ = ndimage.label(is_occupied, structure=np.ones((3, 3)))
    cells = grid.cells.copy()
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        if max(side.stop - side.start for side in box) * grid.resolution > _LARGEST_PIECE:
            continue
        if rng.random() < 1.0 - _MOVED_SHARE:
            continue
        piece = ndimage.binary_fill_holes(pieces[box] == number)
        for _ in range(_TRIES):
            angle = rng.uniform(-np.pi, np.pi)
            distance = rng.uniform(_SHORTEST_MOVE, _LONGEST_MOVE) / grid.resolution
            shifts = np.rint(distance * np.array([np.sin(angle), np.cos(angle)])).astype(int)
            rows, columns = (
                slice(side.start + shift, side.stop + shift) for side, shift in zip(box, shifts, strict=True)
            )
            there = cells[rows, columns]
            if rows.start < 0 or columns.start < 0 or there.shape != piece.shape:
                continue
            if np.all((there[piece] == FREE) | (pieces[rows, columns][piece] == number)):
                cells[box][piece] = FREE
                cells[rows, columns][piece] = OCCUPIED
                break
    return replace(grid, cells=cells)
