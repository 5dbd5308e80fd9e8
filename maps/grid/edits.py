"""Edits of a map: what people know better than scans, drawn over the grid at every rendering."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

EditKind = Literal["erase", "wall", "free", "unknown", "keepout", "speed"]
EDIT_KINDS: tuple[EditKind, ...] = get_args(EditKind)


@dataclass(frozen=True, eq=False)
class Edit:
    """An area, or a wall, and what becomes of it."""

    kind: EditKind
    """``erase``: what was seen there becomes free; ``free``, ``unknown``: all of it does; ``wall``: it is
    occupied; ``keepout``, ``speed``: the map stays as it is, they are in masks of their own."""
    points: NDArray[np.float64]
    """(N, 2) metres in the map: the corners of a polygon, or from where to where a wall goes."""
    width: float = 0.0
    """Metres of a wall, which is a cell wide at least."""
    limit: float = 0.0
    """Metres per second in a ``speed`` area."""

    def moved(self, new_from_map: Pose) -> "Edit":
        """The same in another frame."""
        return replace(self, points=transform_points(new_from_map, self.points))


def edited(grid: OccupancyGrid, edits: Iterable[Edit]) -> OccupancyGrid:
    """The grid with edits drawn over it, the later over the earlier ones."""
    cells = grid.cells.copy()
    for edit in edits:
        if edit.kind in ("keepout", "speed"):
            continue
        area = covered(grid, edit)
        if edit.kind == "erase":
            cells[area & (cells != UNKNOWN)] = FREE
        else:
            cells[area] = {"free": FREE, "unknown": UNKNOWN, "wall": OCCUPIED}[edit.kind]
    return replace(grid, cells=cells)


def keepout_mask(grid: OccupancyGrid, edits: Iterable[Edit]) -> OccupancyGrid:
    """100 where no robot may be, else 0, on the cells of a grid."""
    cells = np.zeros_like(grid.cells)
    for edit in edits:
        if edit.kind == "keepout":
            cells[covered(grid, edit)] = OCCUPIED
    return replace(grid, cells=cells)


def speed_mask(grid: OccupancyGrid, edits: Iterable[Edit]) -> tuple[OccupancyGrid, float]:
    """How fast a robot may be on the cells of a grid, 1 to 100, and 0 where there is no limit; and the metres
    per second that 1 stands for. Where areas overlap, the lowest limit holds."""
    limited = [edit for edit in edits if edit.kind == "speed"]
    unit = max((edit.limit for edit in limited), default=0.0) / OCCUPIED
    cells = np.zeros_like(grid.cells)
    for edit in sorted(limited, key=lambda edit: -edit.limit):
        cells[covered(grid, edit)] = max(1, int(np.floor(edit.limit / unit + 1e-9)))
    return replace(grid, cells=cells), unit


def covered(grid: OccupancyGrid, edit: Edit) -> NDArray[np.bool_]:
    """(rows, columns) the cells whose centres an edit covers; of a wall also those that its line passes."""
    from skimage.draw import polygon2mask  # few maps have edits, and it takes a while to load

    shape = grid.cells.shape
    if edit.kind != "wall":
        return np.asarray(polygon2mask(shape, grid.raster_of(edit.points)), dtype=np.bool_)
    mask = np.zeros(shape, dtype=np.bool_)
    for start, end in zip(edit.points[:-1], edit.points[1:], strict=True):
        mask |= _passed(grid, start, end)
    if edit.width > 0.0:
        from shapely import LineString

        outline = LineString(edit.points).buffer(edit.width / 2, cap_style="flat", join_style="mitre")
        rings = [outline.exterior, *outline.interiors]
        inside, *holes = [polygon2mask(shape, grid.raster_of(np.array(ring.coords))) for ring in rings]
        mask |= inside & ~np.any(holes, axis=0)
    return mask


def _passed(grid: OccupancyGrid, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.bool_]:
    """The cells from one point to another, without a gap through which a ray would pass."""
    steps = 2 + int(np.ceil(4.0 * np.hypot(*(end - start)) / grid.resolution))
    cells = grid.cell_of(start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start))
    rows, columns = cells[grid.contains(cells)].T
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    mask[rows, columns] = True
    return mask
