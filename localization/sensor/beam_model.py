"""The beam model: each reading beside the range that the map says, from a table or from cast rays."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, CODE_OF_CELLS, FARTHEST
from racecar.localization.floor.range_table.range_table import RangeTable
from racecar.localization.sensor.beam_model_kernels import (
    add_up_beams,
    add_up_cast_beams,
    aim,
    are_near,
    expected_ranges,
)
from racecar.localization.sensor.beam_table import MARGIN, TRACKING, log_probability_table, readings_in
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.sensor_model import FITTING, FITTING_SHARE
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan

_CODES_PER_CELL = (1.0 / np.gradient(CELLS_OF_CODE))[CODE_OF_CELLS]
"""(FARTHEST + 1,) at so many cells."""
_CELLS_OF_CODE = np.pad(CELLS_OF_CODE, MARGIN, mode="edge")


class BeamModel:
    """The course's sensor model, `racecar.localization.sensor.beam_table`, on a map."""

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
        if self._table is None:
            return add_up_cast_beams(
                map_from_base,
                _laser_on_base(beams),
                self._free_space.grid_in_map,
                self._free_space.is_standable,
                grid.cells,
                self._free_space.is_movable,
                self._free_space.cells_without_movable,
                beams.bearings + self._turn(beams),
                readings,
                log_probabilities,
                CODE_OF_CELLS,
            )
        places = readings * log_probabilities.shape[1]
        return add_up_beams(
            map_from_base,
            _laser_on_base(beams),
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            self._aim(beams, places, self._table.headings),
            readings,
            log_probabilities,
        )

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam reads about what the map says from each of the poses (N, 3)."""
        most = min(beams.max_range, FARTHEST * self._free_space.grid.resolution)
        expected = self.expected_ranges(map_from_base, beams)
        return are_near(expected, beams.ranges, most, FITTING, FITTING_SHARE)

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
        return expected_ranges(
            map_from_base,
            _laser_on_base(beams),
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            self._aim(beams, np.zeros(len(beams), dtype=np.int64), self._table.headings),
            len(beams),
            np.minimum(_CELLS_OF_CODE * grid.resolution, most),
        )

    def _aim(self, beams: Beams, places: NDArray[np.int64], columns: int) -> NDArray[np.float32]:
        """Of beams that end as far off as they read."""
        resolution = self._free_space.grid.resolution
        turn = self._turn(beams)
        return aim(beams.bearings, turn, beams.ranges, resolution, _CODES_PER_CELL, places, columns)

    def _turn(self, beams: Beams) -> float:
        """Of the laser on the base, less the grid's yaw."""
        return float(beams.base_from_laser[2] - self._free_space.grid.map_from_grid[2])


def _laser_on_base(beams: Beams) -> NDArray[np.float64]:
    """(2,) x and y."""
    return beams.base_from_laser[:2].copy()  # one that is read-only would be compiled for anew
