"""Learn where the surface of walls is within their cells, as maps differ.

In drawn maps walls end at the edges of cells, half a cell before their centres; in maps made from scans, and
in plans of lines, the surface is at the centres on average.
"""

import numpy as np

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.refinement_kernels import signed_distances
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose

PRIOR = 0.25
"""Prior in cells before the centre. Chosen by judgement: the middle."""
_PRIOR_POINTS, _MEMORY_POINTS = 500.0, 20_000.0
"""End points that the prior counts for, and over which the mean is taken. Chosen by judgement: five scans and
a few rooms."""
_NEAR = 2.0
"""Cells from a wall within which a point is on it. Chosen by judgement: farther are people and furniture."""
_STEPS = 20
"""Steps per cell to which the mean is rounded, so that likelihood tables are computed only once."""


class WallSurface:
    """Learns from end points at known poses."""

    def __init__(self, walls: Walls) -> None:
        self._walls = walls
        self._mean, self._points = PRIOR, _PRIOR_POINTS
        self.metres = PRIOR * walls.grid.resolution
        """Metres before the centre of the nearest occupied cell."""

    def learn(self, map_from_base: Pose, points: EndPoints) -> None:
        """Add a scan at a pose (3,)."""
        resolution = self._walls.grid.resolution
        field = self._walls.field(surface=0.0)
        cells = signed_distances(map_from_base, points.in_base, points.laser, field) / resolution
        near = cells[np.abs(cells) < _NEAR]
        if len(near) == 0:
            return
        self._points = min(self._points + len(near), _MEMORY_POINTS)
        self._mean += len(near) / self._points * (float(near.mean()) - self._mean)
        self.metres = min(max(round(self._mean * _STEPS) / _STEPS, 0.0), 0.5) * resolution
