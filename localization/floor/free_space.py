"""Free space: where on a map the car can be."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from racecar.localization.floor.patches import patch_sizes, spread, strips
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_MOST_CELLS = 1_000_000
"""Chosen by judgement: 2500 m² in cells of 5 cm, more than a floor whose walls a small laser meets."""
_SMALLEST_AREA = 1.0
"""Square metres, since the car does not fit on smaller patches: some five times the footprint of one of 0.5 m
by 0.3 m. Isolated free cells from mapping are smaller."""
_UNKNOWN_REACH = 0.8
"""Metres of unknown floor beside free floor on which the car may stand, since a map may not know the floor
under the car that made it, which is within a car's length of what it saw."""
_LARGEST_MOVABLE = 3.0
"""Largest size in metres of furniture that may have been moved; longer obstacles are walls. Chosen by
judgement, since most tables and boxes are shorter, stretches of wall between two doors longer."""


@dataclass(frozen=True, eq=False)
class Region:
    """A circle on the map."""

    center: NDArray[np.float64]
    """(2,) in the map."""
    radius: float
    """Metres."""

    def contains(self, points_in_map: NDArray[np.float64], reach: float = 0.0) -> NDArray[np.bool_]:
        """(N,) whether points (N, 2) are inside, or at most ``reach`` metres outside."""
        off = points_in_map - self.center
        return np.asarray(np.hypot(off[:, 0], off[:, 1]) <= self.radius + reach, dtype=np.bool_)


ANYWHERE = Region(np.zeros(2), np.inf)
"""The whole plane, by definition of an infinite radius."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Cells of a grid that a car can stand on."""

    grid: OccupancyGrid
    is_open: NDArray[np.bool_]
    """(rows, columns)"""
    is_movable: NDArray[np.bool_]
    """(rows, columns) cells of furniture: isolated obstacles, where a car can stand if they were moved."""

    @property
    def cell_count(self) -> int:
        """Number of open cells."""
        return int(np.count_nonzero(self.is_open))

    @cached_property
    def is_standable(self) -> NDArray[np.bool_]:
        """(rows, columns) where a car can be, on this map or after furniture was moved."""
        return self.is_open | self.is_movable

    def contains(self, points_in_map: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,) whether points (N, 2) are in free space."""
        cells = self.grid.cell_of(points_in_map)
        inside = self.grid.contains(cells)
        inside[inside] = self.is_open[tuple(cells[inside].T)]
        return inside

    def within(self, region: Region) -> "FreeSpace":
        """The part within a region."""
        if np.isinf(region.radius):
            return self
        row, column = self.grid.cell_of(region.center[None])[0]
        columns = np.arange(self.is_open.shape[1])
        is_open = np.empty_like(self.is_open)
        for strip in strips(self.is_open.shape):
            rows = np.arange(strip.start, strip.stop)[:, None]
            is_near = np.hypot(rows - row, columns - column) * self.grid.resolution <= region.radius
            is_open[strip] = self.is_open[strip] & is_near
        return replace(self, is_open=is_open)

    def draw_poses(self, count: int, rng: np.random.Generator) -> Pose:
        """(count, 3) poses in the map, uniform over positions and headings."""
        chosen = rng.choice(self.cell_count, size=count)
        within_cell = rng.uniform(-0.5, 0.5, size=(count, 2))
        positions = self.grid.center_of(self._open_cells(chosen) + within_cell)
        return np.column_stack([positions, rng.uniform(-np.pi, np.pi, size=count)])

    def _open_cells(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """(N, 2) row and column of open cells by row-major number (N,)."""
        ends = np.cumsum(np.count_nonzero(self.is_open, axis=1))
        rows = np.searchsorted(ends, numbers, side="right")
        columns = np.empty_like(rows)
        for row in np.unique(rows).tolist():
            is_here = rows == row
            open_columns = np.flatnonzero(self.is_open[row])
            columns[is_here] = open_columns[numbers[is_here] - ends[row]]  # counted from the end of the row
        return np.column_stack([rows, columns])


def find_free_space(grid: OccupancyGrid) -> FreeSpace:
    """Free patches that are large enough, and unknown floor near them.

    (A map may not know the floor that the mapping car itself stood on.) With more than `_MOST_CELLS`, patches
    that reach the grid's edge are left out if others remain: on the map of a track, the endless floor around
    it. At least one cell must be free.
    """
    is_open = _open_floor(grid)
    return FreeSpace(grid, is_open, _find_movable(grid, is_open))


def _open_floor(grid: OccupancyGrid) -> NDArray[np.bool_]:
    free = (grid.cells > UNKNOWN) & (grid.cells < OCCUPIED_FROM)
    patches, count = ndimage.label(free)
    areas = patch_sizes(patches, count) * grid.resolution**2
    areas[0] = 0.0
    wanted = areas >= min(_SMALLEST_AREA, areas.max())
    inner = wanted.copy()
    inner[np.unique(np.concatenate([patches[0], patches[-1], patches[:, 0], patches[:, -1]]))] = False
    if areas[wanted].sum() / grid.resolution**2 > _MOST_CELLS and inner.any():
        wanted = inner
    steps = int(_UNKNOWN_REACH / grid.resolution)
    is_open = spread(wanted, patches)
    if steps > 0:
        passable = grid.cells < OCCUPIED_FROM
        # 4-connected only: across corners it would leak through thin oblique walls
        is_open = ndimage.binary_dilation(is_open, iterations=steps, mask=passable)
    return is_open


def _find_movable(grid: OccupancyGrid, is_open: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(rows, columns) obstacles that are small enough where the car drives, and what they enclose."""
    longest = _LARGEST_MOVABLE / grid.resolution
    is_obstacle = grid.cells >= OCCUPIED_FROM
    outlines = _outlines(is_obstacle, is_open, longest)
    surroundings, count = ndimage.label(~outlines)
    is_inside = patch_sizes(surroundings, count) <= longest**2
    return spread(is_inside, surroundings) & ~is_open & ~is_obstacle | outlines


def _outlines(
    is_obstacle: NDArray[np.bool_], is_open: NDArray[np.bool_], longest: float
) -> NDArray[np.bool_]:
    """(rows, columns) cells of obstacles up to ``longest`` cells, reached from open ones."""
    pieces, count = ndimage.label(is_obstacle, structure=np.ones((3, 3)))
    is_piece = np.zeros(count + 1, dtype=np.bool_)
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        is_piece[number] = max(side.stop - side.start for side in box) <= longest
    reached = ndimage.binary_dilation(is_open, np.ones((3, 3), dtype=np.bool_)) & spread(is_piece, pieces)
    is_piece[:] = False
    is_piece[pieces[reached]] = True
    return spread(is_piece, pieces)
