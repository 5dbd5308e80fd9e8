"""The beam model: each reading beside the range that the map says, from a table or from cast rays."""

import numpy as np
from numpy.typing import NDArray

from localization.beam_model_kernels import add_up_beams, add_up_cast_beams, aim, expected_cells
from localization.beam_table import TRACKING, log_probability_table, readings_in
from localization.beams import Beams
from localization.free_space import FreeSpace
from localization.range_codes import CELLS_OF_CODE, CODE_OF_CELLS, FARTHEST
from localization.range_table import RangeTable
from localization.sensor_model import FITTING, FITTING_SHARE
from maps.ray_casting import cast_ray_fan
from maps.se2 import Pose, compose

_CODES_PER_CELL = (1.0 / np.gradient(CELLS_OF_CODE))[CODE_OF_CELLS]
"""(FARTHEST + 1,) at so many cells."""


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
        log_probabilities = log_probability_table(beams.max_range, grid.resolution, self._squash, TRACKING)
        readings = readings_in(log_probabilities, beams.ranges, grid.resolution)
        laser_on_base, turns = self._on_grid(beams)
        if self._table is None:
            return add_up_cast_beams(
                map_from_base,
                laser_on_base,
                self._free_space.grid_in_map,
                self._free_space.is_standable,
                grid.cells,
                self._free_space.is_movable,
                self._free_space.cells_without_movable,
                turns,
                readings,
                log_probabilities,
                CODE_OF_CELLS,
            )
        return add_up_beams(
            map_from_base,
            laser_on_base,
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            *self._aim(beams, turns),
            readings,
            log_probabilities,
        )

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam reads about what the map says from each of the poses (N, 3)."""
        most = min(beams.max_range, FARTHEST * self._free_space.grid.resolution)
        measured = np.minimum(beams.ranges, most)
        within = FITTING + FITTING_SHARE * measured
        longest = np.where(measured + within < most, measured + within, np.inf)
        expected = self.expected_ranges(map_from_base, beams)
        return (measured - within <= expected) & (expected <= longest)

    def expected_ranges(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N, B) metres that the beams would read by the map from the poses (N, 3); nan off the table.

        At most as many as the table tells or the sensor reaches. From the table they are exact for beams that
        read about that.
        """
        grid = self._free_space.grid
        most = min(beams.max_range, FARTHEST * grid.resolution)
        if self._table is None:
            cast = cast_ray_fan(grid, compose(map_from_base, beams.base_from_laser), beams.bearings, most)
            return np.minimum(cast, most)
        laser_on_base, turns = self._on_grid(beams)
        cells = expected_cells(
            map_from_base,
            laser_on_base,
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            *self._aim(beams, turns),
            CELLS_OF_CODE,
        )
        return np.minimum(cells * grid.resolution, most)

    def _on_grid(self, beams: Beams) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Laser (2,) on the base, and bearings (B,) over the grid."""
        laser_on_base = beams.base_from_laser[:2].copy()  # one that is read-only would be compiled for anew
        turns = beams.bearings + (beams.base_from_laser[2] - self._free_space.grid.map_from_grid[2])
        return laser_on_base, turns

    def _aim(
        self, beams: Beams, turns: NDArray[np.float64]
    ) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
        """Bearings (B,) and parallax (4, B) of beams that end as far off as they read."""
        return aim(turns, beams.ranges / self._free_space.grid.resolution, _CODES_PER_CELL)
