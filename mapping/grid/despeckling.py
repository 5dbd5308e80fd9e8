"""Despeckling: blobs of the size of a person that few keyframes saw may have been somebody walking by.

What crosses the view is looked through sooner or later and fades by itself. What is hidden again before that,
behind a door frame or a shelf, leaves its outline; nothing distinguishes it from a wall but that it is small,
isolated and was seen only briefly. Such cells become unknown.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label

from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN
from racecar.maps.grid.tiled_grid import TILE, Tile, TiledGrid

_ENOUGH_KEYFRAMES = 8
"""Keyframes that must have seen a blob for it to stay. By judgement: 2 m of path and more; pytest
tests/simulated/test_hard_places.py checks it with simulated people."""
_TOUCHING = np.ones((3, 3), dtype=np.bool_)
"""Cells that touch, or have up to two cells between them, are of one blob, because both grow by one to each
side and what touches then belongs together."""
_REACH = 3
"""Cells from one to the next of a blob at most, since up to two may lie between them."""


def despeckled(
    grid: TiledGrid, returns: Iterable[NDArray[np.float64]], keyframes: int, largest: float
) -> TiledGrid:
    """The grid with its specks unknown, which are ``largest`` metres long at most, by the returns (N, 2) in
    the map that each of the keyframes drew."""
    blobs = _small_blobs(grid, largest)
    if not blobs:
        return grid
    cells, blob_of_cell = np.concatenate(blobs), np.repeat(np.arange(len(blobs)), [len(b) for b in blobs])
    order = np.argsort(_number(grid, cells))
    cells, blob_of_cell = cells[order], blob_of_cell[order]
    numbers, looks = _number(grid, cells), np.zeros(len(blobs), dtype=np.int64)
    for points in returns:
        seen = grid.cell_of(points)
        seen = _number(grid, seen[grid.contains(seen)])  # a cropped grid has not all of them
        nearest = np.minimum(np.searchsorted(numbers, seen), len(numbers) - 1)
        looks[np.unique(blob_of_cell[nearest[numbers[nearest] == seen]])] += 1
    is_speck = looks < min(_ENOUGH_KEYFRAMES, keyframes // 2)
    return _without(grid, cells[is_speck[blob_of_cell]])


def _small_blobs(grid: TiledGrid, max_size: float) -> list[NDArray[np.int64]]:
    """(N, 2) row and column of the cells of each blob whose sides are at most so many metres long.

    Each is found in the tile with the first of its cells, of which a margin shows all that it could be.
    """
    margin = int(max_size / grid.resolution) + 1 + _REACH
    blobs = []
    for tile, cells_of_tile in grid.tiles.items():
        if cells_of_tile.max() < OCCUPIED_FROM:
            continue
        first = np.array(tile.first_cell) - margin
        rows, columns = (slice(each, each + TILE + 2 * margin) for each in first.tolist())
        is_occupied = grid.window(rows, columns) >= OCCUPIED_FROM
        numbers, count = label(binary_dilation(is_occupied, _TOUCHING), _TOUCHING)
        numbers[~is_occupied] = 0
        for number, box in enumerate(find_objects(numbers, count), start=1):
            if max(side.stop - side.start for side in box) * grid.resolution > max_size:
                continue
            cells = np.argwhere(numbers[box] == number) + [side.start for side in box] + first
            if tuple((cells[0] // TILE).tolist()) == tile:
                blobs.append(cells)
    return blobs


def _number(grid: TiledGrid, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) a number for each of the grid's cells (N, 2)."""
    return cells[:, 0] * grid.width + cells[:, 1]


def _without(grid: TiledGrid, cells: NDArray[np.int64]) -> TiledGrid:
    """The grid, with some cells (N, 2) unknown."""
    tiles = dict(grid.tiles)
    places, which = np.unique(cells // TILE, axis=0, return_inverse=True)
    for k, place in enumerate(places.tolist()):
        tile = Tile(*place)
        tiles[tile] = tiles[tile].copy()
        tiles[tile][tuple(cells[which.ravel() == k].T % TILE)] = UNKNOWN
    return replace(grid, tiles=tiles)
