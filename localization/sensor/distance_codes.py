"""How far it is to the nearest wall, a byte a pixel: a raster finer or coarser than the cells of the map."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.likelihood_field_kernels import score_places

STEP = 0.01
"""Metres between two codes: by judgement, far below a cell, and 255 of them reach farther than any
deviation."""
CODES = 256
"""Of a byte, by definition; the last one is for all that is farther, and beyond the map."""


class DistanceCodes:
    """Distances to the surfaces of walls, interpolated between those from the centres of cells."""

    def __init__(self, walls: Walls, pixel: float) -> None:
        """The pixels are so many metres wide."""
        self.pixel = pixel
        shape = np.array(walls.distances.shape) * walls.grid.resolution / pixel
        rows, columns = np.maximum(np.rint(shape), 1).astype(np.int64).tolist()
        self.codes = np.full((rows + 2, columns + 2), CODES - 1, dtype=np.uint8)
        """(rows + 2, columns + 2) in steps, with a margin beyond the map."""
        x, y, yaw = walls.grid.map_from_grid
        self.raster_in_map = np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 / pixel])
        """(5,) x, y, cos and sin of the grid's origin and pixels per metre, for the kernels."""
        self._cells_per_pixel = cells_per_pixel = pixel / walls.grid.resolution
        left, right, share = _between_cells(np.arange(columns), cells_per_pixel, walls.distances.shape[1])
        for strip in strips((rows, columns)):
            pixels = np.arange(strip.start, strip.stop)
            below, above, share_up = _between_cells(pixels, cells_per_pixel, walls.distances.shape[0])
            upright = _mixed(walls.distances[below], walls.distances[above], share_up[:, None])
            metres = _mixed(upright[:, left], upright[:, right], share)
            steps = np.clip(np.rint(metres / np.float32(STEP)), 0, CODES - 1)
            self.codes[strip.start + 1 : strip.stop + 1, 1:-1] = steps

    def sums_about(
        self, cells: NDArray[np.int64], points: NDArray[np.float64], value_by_code: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """(C, H) what the codes of H sets of points, seen from the middles of cells (C, 2), are worth.

        The points (H, N, 2) are metres from there along the columns and rows of the grid.
        """
        middles = (cells + 0.5) / self._cells_per_pixel + 1.0  # the codes have a margin
        far = max(self.codes.shape)  # off the map from wherever on it
        offsets = np.clip(np.rint(points[..., ::-1] / self.pixel), -far, far)
        sums = np.empty((len(cells), len(points)), dtype=np.float32)
        turned_points = np.ascontiguousarray(offsets, dtype=np.int32)
        score_places(middles.astype(np.int32), turned_points, self.codes, value_by_code, sums)
        return sums


def _between_cells(
    pixels: NDArray[np.int64], cells_per_pixel: float, cells: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Numbers (N,) of the cells whose centres are before and after those of pixels, and the share between."""
    place = np.clip((pixels + 0.5) * cells_per_pixel - 0.5, 0.0, cells - 1.0)
    before = place.astype(np.int64)
    return before, np.minimum(before + 1, cells - 1), (place - before).astype(np.float32)


def _mixed(
    first: NDArray[np.float32], second: NDArray[np.float32], share: NDArray[np.float32]
) -> NDArray[np.float32]:
    return first + share * (second - first)
