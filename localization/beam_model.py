"""The beam model: each reading beside the range that the map says, from a table or from cast rays."""

import numpy as np
from numpy.typing import NDArray

from localization.beam_model_kernels import add_up_beams, add_up_cast_beams, find_fitting
from localization.beam_table import TRACKING, beam_log_probabilities
from localization.beams import Beams
from localization.free_space import FreeSpace
from localization.range_codes import CELLS_OF_CODE, CODE_OF_CELLS, FARTHEST
from localization.range_table import RangeTable
from localization.sensor_model import FITTING, FITTING_SHARE
from maps.ray_casting import cast_ray_fan
from maps.se2 import Pose, compose

_TURN = 2**16
"""A full turn in the kernel's whole numbers."""


class BeamModel:
    """The course's sensor model, `localization.beam_table`, on a map."""

    def __init__(self, free_space: FreeSpace, table: RangeTable | None, squash: float) -> None:
        """Without a table, rays are cast anew for every particle, which takes some fifty times as long."""
        self._free_space = free_space
        self._table = table
        self._squash = squash

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), to the power 1/squash."""
        grid = self._free_space.grid
        log_probabilities = beam_log_probabilities(
            beams.ranges, beams.max_range, grid.resolution, self._squash, TRACKING
        )
        laser_on_base, grid_in_map, turns = self._on_grid(beams)
        if self._table is None:
            return add_up_cast_beams(
                map_from_base,
                laser_on_base,
                grid_in_map,
                self._free_space.is_standable,
                grid.cells,
                self._free_space.is_movable,
                self._free_space.cells_without_movable,
                turns,
                log_probabilities,
                CODE_OF_CELLS,
            )
        return add_up_beams(
            map_from_base,
            laser_on_base,
            grid_in_map,
            self._table.cell_index,
            self._table.ranges,
            _whole_numbers(turns),
            log_probabilities,
        )

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam reads about what the map says from each of the poses (N, 3)."""
        grid = self._free_space.grid
        most = min(beams.max_range / grid.resolution, FARTHEST)
        measured = np.minimum(beams.ranges / grid.resolution, most)
        within = FITTING / grid.resolution + FITTING_SHARE * measured
        shortest = measured - within
        longest = np.where(measured + within < most, measured + within, np.inf)
        if self._table is None:
            map_from_laser = compose(map_from_base, beams.base_from_laser)
            cast = cast_ray_fan(grid, map_from_laser, beams.bearings, most * grid.resolution)
            expected = np.minimum(cast / grid.resolution, most)
            return np.asarray((shortest <= expected) & (expected <= longest))
        laser_on_base, grid_in_map, turns = self._on_grid(beams)
        return find_fitting(
            map_from_base,
            laser_on_base,
            grid_in_map,
            self._table.cell_index,
            self._table.ranges,
            _whole_numbers(turns),
            np.searchsorted(CELLS_OF_CODE, shortest),
            np.searchsorted(CELLS_OF_CODE, longest, side="right"),
        )

    def _on_grid(self, beams: Beams) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Laser (2,) on the base, grid (5,) in the map for the kernels, and bearings (B,) over the grid."""
        grid = self._free_space.grid
        x, y, yaw = grid.map_from_grid
        laser_on_base = beams.base_from_laser[:2].copy()  # one that is read-only would be compiled for anew
        grid_in_map = np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 / grid.resolution])
        return laser_on_base, grid_in_map, beams.bearings + beams.base_from_laser[2] - yaw


def _whole_numbers(angles: NDArray[np.float64]) -> NDArray[np.uint32]:
    turned: NDArray[np.uint32] = (np.rint(angles / (2.0 * np.pi) * _TURN).astype(np.int64) % _TURN).astype(
        np.uint32
    )
    return turned
