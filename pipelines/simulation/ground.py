"""Uneven ground of a map: hills, and kerbs beside the drivable floor."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid
from racecar.maps.grid.ray_casting import in_cells
from racecar.pipelines.simulation.car import WHEELBASE
from racecar.pipelines.simulation.ground_kernels import cast_over_ground
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, LaserModel

_WAVES = 5
_SHORTEST, _LONGEST = 20.0, 60.0
"""Metres between hilltops. Chosen by judgement: ramps and slopes of a campus."""
_ROUGHNESS = 0.003
"""Standard deviation in metres of the height at which a beam meets the ground. Chosen by judgement: between a
floor and gravel; a beam that comes in at 2° then ends 9 cm sooner or later."""
_TRACK = 0.3
"""Metres between the wheels of an axle; with the wheelbase it determines how the car leans."""


class Ground:
    """Finds what a tilted laser on a leaning car meets first: a wall, or the ground.

    Walls are assumed to be high. Paths uphill are not longer: the ground truth stays in the plane.
    """

    def __init__(
        self, grid: OccupancyGrid, heights: NDArray[np.float64], generator: np.random.Generator
    ) -> None:
        """``heights`` (rows, columns): metres at the centre of each grid cell."""
        self._grid, self._generator = grid, generator
        self._heights = heights.astype(np.float32)
        self._highest = float(self._heights.max())

    def cast(self, map_from_base: Pose, laser: LaserModel, tilt: float) -> NDArray[np.float64]:
        """(beams,) range in metres of each beam from its base pose (beams, 3), with the laser tilted down by
        ``tilt`` degrees; inf beyond its reach."""
        resolution = self._grid.resolution
        ranges = np.empty(laser.beams)
        cast_over_ground(
            self._grid.cells,
            self._heights,
            in_cells(self._grid, map_from_base),
            laser.bearings,
            _ROUGHNESS * self._generator.standard_normal(laser.beams),
            resolution,
            WHEELBASE / resolution,
            _TRACK / resolution,
            BASE_FROM_LASER[0],
            laser.height,
            np.radians(tilt),
            self._highest,
            laser.range_max,
            ranges,
        )
        return ranges


def draw_heights(
    grid: OccupancyGrid, hills: float, kerbs: float, generator: np.random.Generator
) -> NDArray[np.float64]:
    """(rows, columns) metres: five waves of random lengths and directions, nowhere steeper than ``hills``.

    All but free floor is ``kerbs`` metres higher, like the lawn beside the paths.
    """
    rows, columns = grid.cells.shape
    y = grid.resolution * np.arange(rows)[:, None]
    x = grid.resolution * np.arange(columns)[None, :]
    heights = np.where(grid.cells == FREE, 0.0, kerbs)
    for _ in range(_WAVES):
        number = 2.0 * np.pi / generator.uniform(_SHORTEST, _LONGEST)
        direction, phase = generator.uniform(0.0, 2.0 * np.pi, 2)
        along = np.cos(direction) * x + np.sin(direction) * y
        heights += hills / _WAVES / number * np.sin(number * along + phase)
    return heights
