"""Where on a map the car can be."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from racecar.localization.floor.config import FreeSpaceConfig
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED_FROM, UNKNOWN, OccupancyGrid


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The cells of a grid that a car can stand on."""

    grid: OccupancyGrid
    is_open: NDArray[np.bool_]
    """(rows, columns)"""
    is_movable: NDArray[np.bool_]
    """(rows, columns) cells of furniture: lone obstacles, where a car can stand once they were moved."""

    @property
    def cell_count(self) -> int:
        """How many cells there are."""
        return int(np.count_nonzero(self.is_open))

    @cached_property
    def is_standable(self) -> NDArray[np.bool_]:
        """(rows, columns) where a car can be, by this map or since it was made."""
        return self.is_open | self.is_movable

    @cached_property
    def grid_in_map(self) -> NDArray[np.float64]:
        """(5,) x, y, cos and sin of the grid's origin and cells per metre, for the kernels."""
        x, y, yaw = self.grid.map_from_grid
        return np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 / self.grid.resolution])

    @cached_property
    def cells_without_movable(self) -> NDArray[np.int8]:
        """(rows, columns) of the grid, the furniture taken away."""
        return np.where(self.is_movable, np.int8(FREE), self.grid.cells)

    def contains(self, points_in_map: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,) whether points (N, 2) lie on it."""
        cells = self.grid.cell_of(points_in_map)
        inside = self.grid.contains(cells)
        inside[inside] = self.is_open[tuple(cells[inside].T)]
        return inside

    def within(self, metres: float, point_in_map: NDArray[np.float64]) -> "FreeSpace":
        """The part of it that is no farther than so many metres from a point (2,), in a straight line."""
        row, column = self.grid.cell_of(point_in_map[None])[0]
        rows, columns = np.ogrid[: self.is_open.shape[0], : self.is_open.shape[1]]
        is_near = np.hypot(rows - row, columns - column) * self.grid.resolution <= metres
        return replace(self, is_open=self.is_open & is_near)

    def draw_poses(self, count: int, rng: np.random.Generator) -> Pose:
        """(count, 3) poses in the map, spread evenly over all places and headings."""
        cells = np.argwhere(self.is_open)
        chosen = rng.choice(cells, size=count)
        within_cell = rng.uniform(-0.5, 0.5, size=(count, 2))
        positions = self.grid.center_of(chosen + within_cell)
        return np.column_stack([positions, rng.uniform(-np.pi, np.pi, size=count)])


def find_free_space(grid: OccupancyGrid, max_cells: int, config: FreeSpaceConfig) -> FreeSpace:
    """Patches of free cells that are large enough, and the unknown floor near them.

    (A map may not know the floor that the mapping car itself stood on.) Where that is more than
    ``max_cells``, patches that reach the grid's edge are left out if others remain: on the map of a
    track, the endless floor around it. Raises UserError when nothing is free.
    """
    free = (grid.cells > UNKNOWN) & (grid.cells < OCCUPIED_FROM)
    patches, count = ndimage.label(free)
    if count == 0:
        raise UserError(
            "The map has no free cells, so there is no place for a car on it; check its thresholds."
        )
    areas = np.bincount(patches.ravel(), minlength=count + 1) * grid.resolution**2
    areas[0] = 0.0
    wanted = areas >= min(config.smallest_area, areas.max())
    inner = wanted.copy()
    inner[np.unique(np.concatenate([patches[0], patches[-1], patches[:, 0], patches[:, -1]]))] = False
    if areas[wanted].sum() / grid.resolution**2 > max_cells and inner.any():
        wanted = inner
    steps = int(config.unknown_reach / grid.resolution)
    is_open = wanted[patches]
    if steps > 0:
        passable = grid.cells < OCCUPIED_FROM
        # over edges of cells only: corners would let it through thin slanting walls
        is_open = ndimage.binary_dilation(is_open, iterations=steps, mask=passable)
    return FreeSpace(grid, is_open, _find_movable(grid, is_open, config.largest_movable))


def _find_movable(grid: OccupancyGrid, is_open: NDArray[np.bool_], largest: float) -> NDArray[np.bool_]:
    """(rows, columns) obstacles of up to ``largest`` metres where the car drives, and what they enclose."""
    longest = largest / grid.resolution
    is_obstacle = grid.cells >= OCCUPIED_FROM
    pieces, count = ndimage.label(is_obstacle, structure=np.ones((3, 3)))
    is_piece = np.zeros(count + 1, dtype=np.bool_)
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        is_piece[number] = max(side.stop - side.start for side in box) <= longest
    reached = ndimage.binary_dilation(is_open, np.ones((3, 3), dtype=np.bool_)) & is_piece[pieces]
    is_piece[:] = False
    is_piece[pieces[reached]] = True
    outlines = is_piece[pieces]
    surroundings, count = ndimage.label(~outlines)
    is_inside = np.bincount(surroundings.ravel(), minlength=count + 1) <= longest**2
    return is_inside[surroundings] & ~is_open & ~is_obstacle | outlines
