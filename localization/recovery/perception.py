"""The measurement model: evaluate scans at poses on the map."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.refinement.refinement import aligned, refine
from racecar.localization.refinement.wall_surface import WallSurface
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field import LikelihoodField
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_ASKED = 40
"""Particles of a cloud that test each point. Chosen by judgement: a share among 40 is known to 8 %."""
_EXPLAINED = 0.8
"""Mean fit of a point at these, below which it is left out. Measured: with 0.7 moved furniture draws the
cloud aside by a quarter more, without it three times as much."""
_SPREADS = 2.0
"""Standard deviations of the cloud that extend the tolerance of points, the usual gate of 95 %: while the
position along a bend is uncertain, the points that show it are off the walls. Measured: without that a car
with a gyroscope, whose wheels know no turns, is lost in bends ten times as far."""
_FEWEST_LEFT = 0.3
"""Share of points that must remain, or none is left out. Chosen by judgement, as a cloud that has gone astray
must not select the points that suit it."""
_INVERTED_WALL_SHARE = 0.9
"""Share of walls among known cells from which a map may be inverted. Measured: the walls of nine maps of ours
and of others take 0.01 to 0.07, and 0.97 to 0.995 when inverted."""
_INVERTED_WIDTH = 0.8
"""Metres; such a map is rejected if its floor is nowhere wider. Measured: inverted, the walls of those nine
are 0.1 to 0.6 m wide at most, while their floors are wider than 2.7 m somewhere."""


class Perception:
    """Precomputed fields of a map, and the wall surface learned from scans."""

    def __init__(self, grid: OccupancyGrid) -> None:
        """Takes a moment on a large map.

        Raises UserError when the map has no free space or no walls, or seems to be inverted.
        """
        refuse_empty(grid)
        self.walls = Walls(grid)
        self.free_space = find_free_space(grid)
        refuse_inverted(self.walls, self.free_space)
        self.field = LikelihoodField(self.walls, self.free_space)
        self.places = PlaceSearch(self.walls, self.free_space)
        self._surface = WallSurface(self.walls)

    def log_likelihood(self, map_from_base: Pose, points: EndPoints) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan at poses (N, 3)."""
        return self.field.log_likelihood(map_from_base, points, self._surface.metres)

    def aligned(self, map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints) -> Pose:
        """A pose (3,) with covariance (3, 3), aligned with nearby walls, if any."""
        return aligned(map_from_base, covariance, points, self.walls, self._surface.metres)

    def refined(
        self, map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints
    ) -> tuple[Pose, NDArray[np.float64]]:
        """The aligned pose and its covariance (3, 3); unchanged where alignment fails."""
        return refine(map_from_base, covariance, points, self.walls, self._surface.metres)

    def fit(self, map_from_base: Pose, points: EndPoints) -> float | None:
        """Mean fit of a scan's points to the map at a pose (3,); None without points on the map."""
        fits = self.field.fits(map_from_base[None], points, self._surface.metres)
        on_map = fits[~np.isnan(fits)]
        return float(on_map.mean()) if len(on_map) > 0 else None

    def learn_surface(self, map_from_base: Pose, points: EndPoints) -> None:
        """Learn where the surface of walls is within their cells, from a scan at a known pose (3,)."""
        self._surface.learn(map_from_base, points)

    def explained(self, map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints) -> EndPoints:
        """Points that fit the map from most of a cloud (N, 3) with covariance (3, 3); all if too few do.

        As in AMCL's beam skipping (nav2): otherwise, changes since the map was made would draw the cloud to
        places that explain them by chance.
        """
        asked = map_from_base[:: max(1, len(map_from_base) // _ASKED)].copy()  # strides recompile
        tolerance = _SPREADS * sqrt(0.5 * (covariance[0, 0] + covariance[1, 1]))
        fits = self.field.fits(asked, points, self._surface.metres, tolerance)
        is_explained = fits >= _EXPLAINED
        is_enough = np.count_nonzero(is_explained) >= _FEWEST_LEFT * len(points)
        return points.only(is_explained) if is_enough else points


def refuse_empty(grid: OccupancyGrid) -> None:
    """Raise UserError when a map has no free cells or no walls, before fields of its size are allocated."""
    parts = [grid.cells[rows] for rows in strips(grid.shape)]
    if not any(((part > UNKNOWN) & (part < OCCUPIED_FROM)).any() for part in parts):
        raise UserError("The map has no free cells, so a car can stand nowhere on it; check its thresholds.")
    if not any((part >= OCCUPIED_FROM).any() for part in parts):
        raise UserError(
            "The map has no wall, so nothing on it shows where the car is: no pixel is as dark as its "
            "occupied_thresh asks for; lower that, or save the image without transparency, which counts as "
            "brightness."
        )


def refuse_inverted(walls: Walls, free_space: FreeSpace) -> None:
    """Raise UserError when a map seems to be inverted, with walls and floor swapped."""
    cells = walls.grid.cells
    occupied, known = np.count_nonzero(cells >= OCCUPIED_FROM), np.count_nonzero(cells > UNKNOWN)
    widest = 2.0 * float(walls.distances[free_space.is_open].max())
    if occupied > _INVERTED_WALL_SHARE * known and widest < _INVERTED_WIDTH:
        raise UserError(
            f"The map is {occupied / known:.0%} wall and its floor nowhere wider than {widest:.2f} m, as if "
            "walls were taken for floor and floor for walls; change negate in its YAML file, to 0 if it is 1."
        )
