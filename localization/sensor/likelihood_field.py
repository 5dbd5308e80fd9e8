"""The likelihood field: how far the end of each beam is from the nearest wall, whatever lies before it.

Thrun, Burgard, Fox: Probabilistic Robotics (2005), section 6.4. It ignores what rays pass through, but it is
smooth and casts no rays. Misses do not count.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import RANGE_STEP
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.config import LikelihoodFieldConfig
from racecar.localization.sensor.likelihood_field_kernels import add_up_ends
from racecar.maps.geometry.se2 import Pose, transform_points

_FARTHEST = 255
"""Cells from a wall, since a byte counts no more; beyond 2.5 m, on the finest map, a beam is as likely
anywhere."""


class LikelihoodField:
    """The sensor model that looks at the ends of the beams only."""

    def __init__(
        self, free_space: FreeSpace, walls: Walls, config: LikelihoodFieldConfig, squash: float
    ) -> None:
        cells = walls.distances / np.float32(walls.grid.resolution)
        self._cells_to_wall = np.minimum(np.rint(cells), _FARTHEST).astype(np.uint8)
        self._free_space = free_space
        self._agreement_distance = config.agreement_distance
        self._log_probabilities = _log_probabilities(walls.grid.resolution, config, squash)

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), to the power 1/squash."""
        ends = transform_points(beams.base_from_laser, beams.end_points)
        return add_up_ends(
            map_from_base,
            self._free_space.grid_in_map,
            self._cells_to_wall,
            self._free_space.is_standable,
            ends,
            self._log_probabilities,
        )

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam ends near a wall from each of the poses (N, 3); misses count as if."""
        grid = self._free_space.grid
        ends = transform_points(beams.base_from_laser, beams.end_points)
        cells = grid.cell_of(np.concatenate([transform_points(pose, ends) for pose in map_from_base]))
        inside = grid.contains(cells)
        is_near = np.zeros(len(cells), dtype=np.bool_)
        is_near[inside] = (
            self._cells_to_wall[tuple(cells[inside].T)] * grid.resolution <= self._agreement_distance
        )
        fits = np.ones((len(map_from_base), len(beams)), dtype=np.bool_)
        fits[:, np.isfinite(beams.ranges)] = is_near.reshape(len(map_from_base), len(ends))
        return fits


def _log_probabilities(
    resolution: float, config: LikelihoodFieldConfig, squash: float
) -> NDArray[np.float32]:
    """(256,) log-probability of an end point at each number of cells from a wall; the last is beyond the map.

    Like those of the beam model, probabilities are per step of 5 cm, whatever the size of a cell.
    """
    steps, deviation = (
        np.arange(_FARTHEST + 1.0) * (resolution / RANGE_STEP),
        config.hit_deviation / RANGE_STEP,
    )
    hit = np.exp(-0.5 * (steps / deviation) ** 2)
    hit *= config.hit / (deviation * np.sqrt(2.0 * np.pi))
    anywhere = config.random / (config.random_range / RANGE_STEP)
    return (np.log(hit + anywhere) / squash).astype(np.float32)
