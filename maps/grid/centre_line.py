"""The centre line of a race track and the track's width on both sides."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.closed_line import resampled_ring, ring_length, ring_normals, smoothed_ring
from racecar.maps.grid.lap import SHORTEST_LAP
from racecar.maps.grid.middle_line import middle_line
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.track_bounds import Bound, TrackBounds, crossing_normals

_FINE = 5
"""Width measurements per point of the line, since a thin post may stand between two points."""


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A closed line in the direction of driving; the last point connects to the first."""

    points: NDArray[np.float64]
    """(N, 2) metres in the map."""
    right: Bound
    """The right-hand boundary."""
    left: Bound
    """The left-hand boundary."""

    @property
    def length(self) -> float:
        """Length of the closed line in metres."""
        return ring_length(self.points)

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N, 2) unit vectors to the left."""
        return ring_normals(self.points)

    @property
    def widths(self) -> NDArray[np.float64]:
        """(N,) metres from the right-hand to the left-hand boundary."""
        return self.right.widths + self.left.widths

    @property
    def is_walled(self) -> NDArray[np.bool_]:
        """(N,) whether both boundaries are walls."""
        return self.right.is_wall & self.left.is_wall

    @property
    def crossed(self) -> NDArray[np.int64]:
        """(M,) indices of points whose normals, as long as the track is wide, cross those of later points on
        the same stretch."""
        crossing = crossing_normals(self.points, self.left.widths, self.right.widths)
        first, second = crossing.here, crossing.there
        apart = np.minimum(second - first, len(self.points) + first - second)
        return np.unique(first[(first < second) & (apart * self.length < SHORTEST_LAP * len(self.points))])


def centre_line(
    grid: OccupancyGrid,
    lap: NDArray[np.float64],
    returns: NDArray[np.floating[Any]],
    *,
    spacing: float,
    smoothing: float,
) -> CentreLine:
    """The centre line of the track on which a lap (N, 2) was driven: equally far from everything that bounds
    it on the left and on the right of the lap.

    Widths end at the ``returns`` (M, 2), in metres, because occupied cells are as thick as the returns
    scatter. Points are ``spacing`` metres apart and smoothed by a Gaussian of ``smoothing`` metres. At 0.3,
    normals as long as the shipped track is wide cross one another; at 0.5, as measured, none do.

    Raises UserError where most of a side has no wall, or no wall divides the lanes of the lap.
    """
    bounds = TrackBounds(grid, returns)
    left, right = bounds.beside(lap)
    middle = middle_line(grid, bounds.blocked, lap, left.is_met & right.is_met)
    middle = smoothed_ring(resampled_ring(middle, grid.resolution), smoothing / grid.resolution)
    middle = resampled_ring(middle, spacing / _FINE, _FINE)
    left, right = bounds.beside(middle, _FINE)
    return CentreLine(middle[::_FINE], right, left)
