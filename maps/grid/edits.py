"""Edits of a map: what people know better than the scans, drawn over the grid at every rendering."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from racecar.maps.grid.tiled_grid import TILE, Tile, TiledGrid, tiles_in

EditKind = Literal["erase", "wall", "free", "unknown", "keepout", "speed"]
EDIT_KINDS: tuple[EditKind, ...] = get_args(EditKind)


@dataclass(frozen=True, eq=False)
class Edit:
    """An area or a wall, and what to do with it."""

    kind: EditKind
    """``erase``: seen cells become free; ``free``, ``unknown``: all cells do; ``wall``: cells become
    occupied; ``keepout``, ``speed``: the map stays as it is, these go into separate masks."""
    points: NDArray[np.float64]
    """(N, 2) metres in the map: corners of a polygon, or vertices of a wall."""
    width: float = 0.0
    """Thickness of a wall in metres; at least one cell is drawn."""
    limit: float = 0.0
    """Metres per second in a ``speed`` area."""

    def moved(self, new_from_map: Pose) -> "Edit":
        """The same edit in another frame."""
        return replace(self, points=transform_points(new_from_map, self.points))


def edited(grid: TiledGrid, edits: Iterable[Edit]) -> TiledGrid:
    """The grid with edits drawn over it; later edits win."""
    for edit in edits:
        if edit.kind == "erase":
            grid = _drawn_over(grid, edit, FREE, only_known=True)
        elif edit.kind not in ("keepout", "speed"):
            grid = _drawn_over(grid, edit, {"free": FREE, "unknown": UNKNOWN, "wall": OCCUPIED}[edit.kind])
    return grid


def keepout_mask(grid: TiledGrid, edits: Iterable[Edit]) -> TiledGrid:
    """Keepout mask over the cells of a grid: 100 where no robot may go, else 0."""
    mask = replace(grid, tiles={}, elsewhere=FREE)
    for edit in edits:
        if edit.kind == "keepout":
            mask = _drawn_over(mask, edit, OCCUPIED)
    return mask


def speed_mask(grid: TiledGrid, edits: Iterable[Edit]) -> tuple[TiledGrid, float]:
    """Speed mask over the cells of a grid, 1 to 100, 0 where there is no limit; and the metres per second per
    unit. Where areas overlap, the lowest limit holds."""
    limited = [edit for edit in edits if edit.kind == "speed"]
    unit = max((edit.limit for edit in limited), default=0.0) / OCCUPIED
    mask = replace(grid, tiles={}, elsewhere=0)
    for edit in sorted(limited, key=lambda edit: -edit.limit):
        mask = _drawn_over(mask, edit, max(1, int(np.floor(edit.limit / unit + 1e-9))))
    return mask, unit


def _drawn_over(grid: TiledGrid, edit: Edit, value: int, *, only_known: bool = False) -> TiledGrid:
    """The grid with a value in the cells that an edit covers, optionally only in known cells."""
    tiles = dict(grid.tiles)
    for tile, area in covered(grid, edit):
        cells = grid.tile(tile)
        tiles[tile] = np.where(area & (cells != UNKNOWN) if only_known else area, np.int8(value), cells)
    return replace(grid, tiles=tiles)


def covered(grid: TiledGrid, edit: Edit) -> Iterator[tuple[Tile, NDArray[np.bool_]]]:
    """Tiles that an edit touches and (TILE, TILE) which of their cells it covers: those whose centre lies
    inside. A wall also covers the cells its line crosses."""
    from skimage.draw import polygon2mask  # slow to import, and few maps have edits

    rings = [grid.raster_of(ring) for ring in _rings(edit)]
    line = _passed(grid, edit.points) if edit.kind == "wall" else np.zeros((0, 2), dtype=np.int64)
    corners = np.concatenate([*rings, line])
    if len(corners) == 0:
        return  # the wall lies outside the grid
    low = np.clip(np.floor(corners.min(axis=0)), 0, grid.shape).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=0)) + 1, 0, grid.shape).astype(np.int64)
    for tile in tiles_in(*(slice(*span) for span in zip(low.tolist(), high.tolist(), strict=True))):
        first = np.array(tile.first_cell)
        area = np.zeros((TILE, TILE), dtype=np.bool_)
        for ring in rings:  # the first ring is the outline, the others are holes
            area ^= polygon2mask(area.shape, ring - first)
        here = line - first
        area[tuple(here[np.all((here >= 0) & (here < TILE), axis=1)].T)] = True
        height, width = np.minimum(np.array(grid.shape) - first, TILE).tolist()
        area[height:], area[:, width:] = False, False
        if area.any():
            yield tile, area


def _rings(edit: Edit) -> list[NDArray[np.float64]]:
    """Rings (N, 2) in metres: the outline of what an edit covers, then its holes. Thin walls have none."""
    if edit.kind != "wall":
        return [edit.points]
    if edit.width == 0.0:
        return []
    from shapely import LineString

    outline = LineString(edit.points).buffer(edit.width / 2, cap_style="flat", join_style="mitre")
    return [np.array(ring.coords) for ring in (outline.exterior, *outline.interiors)]


def _passed(grid: TiledGrid, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(M, 2) cells along a polyline (N, 2), without gaps that a ray could pass through."""
    passed = []
    for start, end in pairwise(points):
        steps = 2 + int(np.ceil(4.0 * np.hypot(*(end - start)) / grid.resolution))
        cells = grid.cell_of(start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start))
        passed.append(cells[grid.contains(cells)])
    return np.concatenate(passed)
