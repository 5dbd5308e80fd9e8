"""Where on a map a single scan fits best, told by trying everything: slow, but it cannot lose its way."""

import numpy as np
from numpy.typing import NDArray

from maps.distance_field import distance_to_occupied
from maps.occupancy_grid import FREE, OccupancyGrid
from maps.scan import Scan
from maps.se2 import Pose, between, compose, inverse
from pipelines.benchmark_accuracy_kernels import mean_fits

_COARSE, _COARSE_TURN, _COARSE_POINTS = 0.2, np.radians(4.0), 60
_FINE, _FINE_TURN, _FINE_POINTS = 0.02, np.radians(1.0), 360
"""Metres and radians between the poses that are tried, and how many end points tell their fit."""
_SHORTLIST, _CANDIDATES, _APART = 20_000, 40, 0.4
"""Of the coarse poses so many are the best, of which those are tried finely that lie so many metres apart."""
_STEPS, _TURN_STEPS = np.arange(-10, 11), np.arange(-5, 6)
_CLEARANCE = 0.1
"""Metres from a wall at which a laser can be."""


class ExhaustiveMatcher:
    """Tries all free places of a map, facing any way, by how near the scan's end points are to walls."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        self._distances = distance_to_occupied(grid)
        step = max(1, round(_COARSE / grid.resolution))
        cells = np.argwhere((grid.cells == FREE) & (self._distances > _CLEARANCE))
        places = grid.center_of(cells[np.all(cells % step == step // 2, axis=1)])
        headings = np.arange(-np.pi, np.pi, _COARSE_TURN)
        self._map_from_laser = np.column_stack(
            [np.repeat(places, len(headings), axis=0), np.tile(headings, len(places))]
        )

    def match(self, scan: Scan, map_from_base: Pose) -> tuple[Pose, float]:
        """The pose (3,) of the base that fits best, and by how much more than the given one (3,) it does.

        Fits are means over the end points, 1 on a wall and 1/2 at 0.1 m. The car's motion during the sweep
        is left out of account.
        """
        points = scan.points_in_base()
        candidates = self._coarsely(_thinned(points, _COARSE_POINTS), inverse(scan.base_from_laser))
        points = _thinned(points, _FINE_POINTS)
        found = [self._finely(points, pose) for pose in (map_from_base, *candidates)]
        best, fit = max(found, key=lambda pose_and_fit: pose_and_fit[1])
        return best, fit - float(self._fits(points, map_from_base[None])[0])

    def _coarsely(self, points: NDArray[np.float64], laser_from_base: Pose) -> list[Pose]:
        """The best poses of the base that are not beside one another."""
        map_from_base = compose(self._map_from_laser, laser_from_base)
        order = np.argsort(-self._fits(points, map_from_base), kind="stable")
        left = map_from_base[order[:_SHORTLIST]]
        chosen: list[Pose] = []
        while len(left) > 0 and len(chosen) < _CANDIDATES:
            chosen.append(left[0])
            left = left[np.hypot(*(left - left[0])[:, :2].T) > _APART]
        return chosen

    def _finely(self, points: NDArray[np.float64], pose: Pose) -> tuple[Pose, float]:
        """The best of a lattice about a pose, and of one four times as fine about that; and its fit."""
        fit = 0.0
        for fineness in (1.0, 0.25):
            x, y, yaw = np.meshgrid(_FINE * _STEPS, _FINE * _STEPS, _FINE_TURN * _TURN_STEPS)
            poses = pose + fineness * np.column_stack([x.ravel(), y.ravel(), yaw.ravel()])
            fits = self._fits(points, poses)
            pose, fit = poses[np.argmax(fits)], float(fits.max())
        return pose, fit

    def _fits(self, points: NDArray[np.float64], map_from_base: Pose) -> NDArray[np.float64]:
        grid_from_base = between(self._grid.map_from_grid, map_from_base)
        return mean_fits(grid_from_base, points, self._distances, self._grid.resolution)


def _thinned(points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    return points[np.linspace(0, len(points) - 1, min(count, len(points))).astype(np.int64)]
