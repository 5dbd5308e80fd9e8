"""A floor plan as it was drawn."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import OCCUPIED, OccupancyGrid

_MOST_CELLS = 16_000_000
"""Cells of a drawing. Chosen by judgement: twice as many as a picture shows."""


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """The walls of a drawing, in its units, x to the right and y upwards."""

    name: str
    lines: NDArray[np.float64]
    """(N, 2, 2) ends of lines: walls, or the faces of walls."""
    faces: NDArray[np.float64]
    """(N, 2) unit vectors off the wall, where a line is the face of one; else (0, 0)."""
    unit: str
    """What a unit of the drawing is called, such as pixel."""
    metres_per_unit: float | None = None
    """As the drawing states it; None if it does not."""
    top: float | None = None
    """Upper edge, if its own y points down from there, as in images."""
    darkness: NDArray[np.int8] | None = None
    """(rows, columns) percent of the pixels, lowest row first, if it is an image."""

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (N, 2) in the coordinates of its file, with y upwards."""
        return points if self.top is None else points * [1.0, -1.0] + [0.0, self.top]

    def sampled(self, spacing: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points (M, 2) on its lines, at most ``spacing`` apart, and the normals (M, 2) there; both sides of
        a line that is no face."""
        steps = self.lines[:, 1] - self.lines[:, 0]
        lengths = np.hypot(*steps.T)
        counts = np.ceil(lengths / spacing).astype(np.int64)
        of = np.repeat(np.arange(len(counts)), counts)
        nth = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
        points = self.lines[of, 0] + steps[of] * ((nth + 0.5) / counts[of])[:, None]
        normals = np.column_stack([-steps[of, 1], steps[of, 0]]) / lengths[of, None]
        is_face = self.faces[of].any(axis=1)
        normals[is_face] = self.faces[of][is_face]
        return np.concatenate([points, points[~is_face]]), np.concatenate([normals, -normals[~is_face]])

    def drawn(self, metres_per_unit: float, resolution: float) -> OccupancyGrid:
        """The drawing in its frame in metres: an image as it is, lines in cells of ``resolution`` metres."""
        if self.darkness is not None and self.top is not None:
            pixel = self.top / len(self.darkness)
            return OccupancyGrid(self.darkness, pixel * metres_per_unit, IDENTITY)
        places = metres_per_unit * self.lines.reshape(-1, 2)
        low, high = places.min(axis=0) - resolution, places.max(axis=0) + resolution
        resolution = max(resolution, math.sqrt(float(np.prod(high - low)) / _MOST_CELLS))
        columns, rows = np.ceil((high - low) / resolution).astype(int) + 1
        cells = np.zeros((rows, columns), dtype=np.int8)
        grid = OccupancyGrid(cells, resolution, np.append(low, 0.0))
        points = metres_per_unit * self.sampled(0.5 * resolution / metres_per_unit)[0]
        cells[tuple(grid.cell_of(points).T)] = OCCUPIED
        return grid


def lines_of(polylines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """(M, 2, 2) lines of some length between neighbouring points of polylines (N, 2)."""
    pieces = [np.stack([points[:-1], points[1:]], axis=1) for points in polylines]
    lines = np.concatenate([np.zeros((0, 2, 2)), *pieces])
    are: NDArray[np.bool_] = np.isfinite(lines).all(axis=(1, 2)) & (lines[:, 0] != lines[:, 1]).any(axis=1)
    return lines[are]
