"""The beam model: each reading compared with the range by the map, from a table or from cast rays."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import RANGE_STEP, RangeCodes
from racecar.localization.floor.range_table.range_table import VIEWPOINT_REACH, RangeTable
from racecar.localization.sensor.beam_model_kernels import (
    add_up_beams,
    add_up_cast_beams,
    aim,
    are_near,
    expected_ranges,
)
from racecar.localization.sensor.beam_table import log_probability_table, rows_of
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.config import BeamModelConfig
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan

_MOST_CODES_PER_CELL = 30.0
"""By which ranges are corrected for where the laser is in a block of cells, since the table's words have room
for no more; cells of up to 1.5 m need no more."""


class BeamModel:
    """The course's sensor model, `racecar.localization.sensor.beam_table`, on a map."""

    def __init__(
        self, free_space: FreeSpace, table: RangeTable | RangeCodes, config: BeamModelConfig, squash: float
    ) -> None:
        """Without a table, of which only the codes are known, rays are cast anew for every particle.

        That takes some fifty times as long.
        """
        self._free_space = free_space
        self._table = table if isinstance(table, RangeTable) else None
        self._codes = table.codes if isinstance(table, RangeTable) else table
        self._config = config
        self._squash = squash
        self._steps_per_cell = free_space.grid.resolution / RANGE_STEP
        self._codes_per_cell = np.minimum(
            self._codes.codes_per_step * self._steps_per_cell, _MOST_CODES_PER_CELL
        )
        self._margin = int(np.ceil(VIEWPOINT_REACH * self._codes_per_cell.max()))
        self._range_of_code = np.pad(self._codes.steps, self._margin, mode="edge") * RANGE_STEP

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), to the power 1/squash.

        A pose where the car cannot be gets what the least likely readings would give.
        """
        log_probabilities = log_probability_table(
            beams.max_range, self._squash, self._config, self._codes, self._margin
        )
        rows = rows_of(beams.ranges, log_probabilities)
        if self._table is None:
            return add_up_cast_beams(
                map_from_base,
                _laser_on_base(beams),
                self._free_space.grid_in_map,
                self._free_space.is_standable,
                self._free_space.grid.cells,
                self._free_space.is_movable,
                self._free_space.cells_without_movable,
                beams.bearings + self._turn(beams),
                rows,
                log_probabilities,
                self._codes.code_of_steps,
                self._steps_per_cell,
                self._margin,
            )
        return add_up_beams(
            map_from_base,
            _laser_on_base(beams),
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            self._aim(beams, rows * log_probabilities.shape[1], self._table.headings),
            rows,
            log_probabilities,
        )

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam agrees with the map from each of the poses (N, 3)."""
        longest, agreement = min(beams.max_range, self._codes.longest_range), self._config.agreement
        expected = self.expected_ranges(map_from_base, beams)
        return are_near(expected, beams.ranges, longest, agreement.distance, agreement.share)

    def expected_ranges(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N, B) metres that the beams would read by the map from the poses (N, 3); nan off the table.

        At most the longest range of the table, or of the sensor. From the table they are exact for beams that
        read about that.
        """
        longest = min(beams.max_range, self._codes.longest_range)
        if self._table is None:
            map_from_laser = compose(map_from_base, beams.base_from_laser)
            cast = cast_ray_fan(self._free_space.grid, map_from_laser, beams.bearings, longest)
            return np.minimum(cast, longest)
        return expected_ranges(
            map_from_base,
            _laser_on_base(beams),
            self._free_space.grid_in_map,
            self._table.cell_index,
            self._table.viewpoints,
            self._table.ranges,
            self._aim(beams, np.zeros(len(beams), dtype=np.int64), self._table.headings),
            len(beams),
            np.minimum(self._range_of_code, longest),
        )

    def _aim(self, beams: Beams, places: NDArray[np.int64], columns: int) -> NDArray[np.float32]:
        """For beams that end as far off as they read."""
        return aim(
            beams.bearings,
            self._turn(beams),
            beams.ranges,
            self._free_space.grid.resolution,
            self._steps_per_cell,
            self._codes_per_cell,
            places + self._margin,
            columns,
        )

    def _turn(self, beams: Beams) -> float:
        """Yaw of the laser on the base, less the grid's yaw."""
        return float(beams.base_from_laser[2] - self._free_space.grid.map_from_grid[2])


def _laser_on_base(beams: Beams) -> NDArray[np.float64]:
    """(2,) x and y."""
    return beams.base_from_laser[:2].copy()  # numba would compile again for a read-only one
