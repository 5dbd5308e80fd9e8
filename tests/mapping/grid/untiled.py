"""Rendering as it would be without tiles: counts, blobs and distances of the whole plane at once."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, distance_transform_edt, find_objects, label

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.despeckling import _ENOUGH_KEYFRAMES
from racecar.mapping.grid.log_odds import log_odds, occupancy
from racecar.mapping.grid.rendering import Box, Rays, touched_by
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid


def untiled(
    rays: Sequence[Rays], poses: Pose, resolution: float, config: RenderingConfig, box: Box | None
) -> OccupancyGrid:
    """The grid of rays (K) seen from poses (K, 3)."""
    touched = [touched_by(ray, pose) for pose, ray in zip(poses, rays, strict=True)]
    everything = np.concatenate(touched)
    low, high = everything.min(axis=0) - config.margin, everything.max(axis=0) + config.margin
    if box is not None:
        low, high = np.maximum(low, box[0]), np.minimum(high, box[1])
    low = np.floor(low / resolution) * resolution
    columns, rows = np.ceil((high - low) / resolution).astype(int)
    hits, passes = np.zeros((rows, columns), dtype=np.uint16), np.zeros((rows, columns), dtype=np.uint16)
    scans = [(points - low) / resolution for points in touched]
    for cells, ray in zip(scans, rays, strict=True):
        ends = _inside(np.floor(cells[: ray.returns]).astype(int), hits)
        hit = set(map(tuple, ends.tolist()))
        passed = {cell for end in cells[: ray.returns] for cell in _way(cells[-1], end)}
        _count(hits, hit)
        _count(passes, passed - hit)
    worth = -log_odds(config.hit_probability) / log_odds(config.pass_probability)
    for cells, ray in zip(scans, rays, strict=True):
        marked = set(map(tuple, np.floor(cells[: ray.returns]).astype(int).tolist()))
        for end in cells[ray.returns : -1]:
            for column, row in _way(cells[-1], end):
                if not (0 <= row < rows and 0 <= column < columns):
                    continue
                if (column, row) not in marked:
                    marked.add((column, row))
                    passes[row, column] += 1
                if hits[row, column] * worth > passes[row, column]:
                    break
    return OccupancyGrid(occupancy(hits, passes, config), resolution, np.array([low[0], low[1], 0.0]))


def untiled_despeckled(
    grid: OccupancyGrid, returns: Sequence[NDArray[np.float64]], largest: float
) -> NDArray[np.int8]:
    """The cells of a grid without specks, by the returns (N, 2) of each keyframe."""
    occupied = grid.cells >= OCCUPIED_FROM
    touching = np.ones((3, 3), dtype=np.bool_)
    blobs, count = label(binary_dilation(occupied, touching), touching)
    blobs[~occupied] = 0
    looks = np.zeros(count + 1, dtype=np.int64)
    for points in returns:
        cells = grid.cell_of(points)
        rows, columns = cells[grid.contains(cells)].T
        looks[np.unique(blobs[rows, columns])] += 1
    sizes = [max(s.stop - s.start for s in box) * grid.resolution for box in find_objects(blobs, count)]
    many = min(_ENOUGH_KEYFRAMES, len(returns) // 2)
    is_speck = np.append(False, (np.array(sizes) <= largest) & (looks[1:] < many))
    return np.where(is_speck[blobs], UNKNOWN, grid.cells).astype(np.int8)


def untiled_near_path(grid: OccupancyGrid, path: NDArray[np.float64], margin: float) -> NDArray[np.int8]:
    """The cells of a grid up to a margin from a path (K, 2)."""
    is_far = np.ones(grid.shape, dtype=np.bool_)
    rows, columns = grid.cell_of(path).T
    is_far[rows, columns] = False
    distances = distance_transform_edt(is_far, sampling=grid.resolution)
    return np.where(distances <= margin, grid.cells, UNKNOWN).astype(np.int8)


def _way(start: NDArray[np.float64], end: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Column and row of the cells from one place to before another, in cells."""
    (column, row), (last_column, last_row) = np.floor(start).astype(int), np.floor(end).astype(int)
    steps = np.where(end > start, 1, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.abs(1.0 / (end - start))
        to_next = np.where(end > start, np.floor(start) + 1 - start, start - np.floor(start)) * each
    to_next[end == start] = np.inf
    way = []
    for _ in range(abs(last_column - column) + abs(last_row - row)):
        way.append((int(column), int(row)))
        if to_next[0] < to_next[1]:
            to_next[0] += each[0]
            column += steps[0]
        else:
            to_next[1] += each[1]
            row += steps[1]
    return way


def _inside(cells: NDArray[np.int64], counts: NDArray[np.uint16]) -> NDArray[np.int64]:
    """Those of some cells (N, 2), column and row, that there are."""
    return cells[np.all((cells >= 0) & (cells < counts.shape[::-1]), axis=1)]


def _count(counts: NDArray[np.uint16], cells: set[tuple[int, int]]) -> None:
    for column, row in cells:
        if 0 <= row < counts.shape[0] and 0 <= column < counts.shape[1]:
            counts[row, column] += 1
