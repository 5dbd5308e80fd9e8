"""Remove specks: person-sized blobs seen by few keyframes may have been people.

Beams sooner or later pass through what moves across open view, and it fades by itself. What is soon occluded
again, by a door frame or a shelf, leaves an outline. It differs from a wall only in being small, isolated and
briefly seen. Such cells become unknown.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label

from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN
from racecar.maps.grid.tiled_grid import TILE, Tile, TiledGrid

_ENOUGH_KEYFRAMES = 8
"""Keyframes that must have seen a blob to keep it. Chosen by judgement: 2 m of path and more; pytest
tests/simulated/test_hard_places.py checks it with simulated people."""
_TOUCHING = np.ones((3, 3), dtype=np.bool_)
"""Neighbourhood for dilation by one cell: cells with up to two cells between them become one blob, because
both grow by one to each side and then touch."""
_REACH = 3
"""Distance in cells within a blob at most, since up to two may lie between."""


def despeckled(
    grid: TiledGrid, returns: Iterable[NDArray[np.float64]], keyframes: int, largest: float
) -> TiledGrid:
    """Make specks of at most ``largest`` metres unknown, given the returns (N, 2) in the map of each
    keyframe."""
    blobs = _small_blobs(grid, largest)
    if not blobs:
        return grid
    cells, blob_of_cell = np.concatenate(blobs), np.repeat(np.arange(len(blobs)), [len(b) for b in blobs])
    order = np.argsort(_number(grid, cells))
    cells, blob_of_cell = cells[order], blob_of_cell[order]
    numbers, looks = _number(grid, cells), np.zeros(len(blobs), dtype=np.int64)
    for points in returns:
        seen = grid.cell_of(points)
        seen = _number(grid, seen[grid.contains(seen)])  # a cropped grid lacks some of them
        nearest = np.minimum(np.searchsorted(numbers, seen), len(numbers) - 1)
        looks[np.unique(blob_of_cell[nearest[numbers[nearest] == seen]])] += 1
    is_speck = looks < min(_ENOUGH_KEYFRAMES, keyframes // 2)
    return _without(grid, cells[is_speck[blob_of_cell]])


def _small_blobs(grid: TiledGrid, max_size: float) -> list[NDArray[np.int64]]:
    """(N, 2) row and column of the cells of each blob up to ``max_size`` metres wide and high.

    Each is found in the tile with its first cell, with a margin that shows its full possible extent.
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
    """(N,) unique numbers of cells (N, 2) of the grid."""
    return cells[:, 0] * grid.width + cells[:, 1]


def _without(grid: TiledGrid, cells: NDArray[np.int64]) -> TiledGrid:
    """The grid with some cells (N, 2) set to unknown."""
    tiles = dict(grid.tiles)
    places, which = np.unique(cells // TILE, axis=0, return_inverse=True)
    for k, place in enumerate(places.tolist()):
        tile = Tile(*place)
        tiles[tile] = tiles[tile].copy()
        tiles[tile][tuple(cells[which.ravel() == k].T % TILE)] = UNKNOWN
    return replace(grid, tiles=tiles)
