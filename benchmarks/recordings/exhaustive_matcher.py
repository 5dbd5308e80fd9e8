"""Finds the pose near a given one where scans fit best, by brute force: slow, but no filter.

On a whole map a scan of a corridor, or of a room that has changed since the map was made, often fits best
tens of metres away, or rotated. So the search covers only a few metres, and a sixth of a turn to each side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.recordings.exhaustive_matcher_kernels import mean_fits
from racecar.localization.sensor.end_points import EndPoints, evenly
from racecar.maps.geometry.se2 import Pose, between, compose, inverse, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan

_WINDOW, _TURN_WINDOW = 4.0, np.radians(60.0)
"""Search range around a pose in metres and radians."""
_COARSE, _COARSE_TURN, _COARSE_POINTS = 0.2, np.radians(4.0), 120
_FINE, _FINE_TURN, _FINE_POINTS = 0.02, np.radians(1.0), 720
"""Metres and radians between tested poses, and the number of end points used."""
_SHORTLIST, _CANDIDATES, _APART = 5_000, 20, 0.4
"""Number of best coarse poses considered, number of them refined, and the minimum metres between these."""
_STEPS, _TURN_STEPS = np.arange(-10, 11), np.arange(-5, 6)
_CLEARANCE = 0.1
"""Minimum metres from a wall to the laser."""
_BEHIND = 0.3
"""Metres behind a wall at which an end point certainly does not lie on it."""


@dataclass(frozen=True, eq=False)
class ScanSegment:
    """The scans of a path segment and their poses relative to one place on it."""

    scans: list[EndPoints]
    here_from_base: Pose
    """(S, 3)"""

    def end_points(self) -> NDArray[np.float64]:
        """(N, 2) end points of all scans relative to that place."""
        clouds = [
            transform_points(pose, scan.in_base)
            for scan, pose in zip(self.scans, self.here_from_base, strict=True)
        ]
        return np.concatenate(clouds)


class ExhaustiveMatcher:
    """Scores all free places around a pose by the distance of end points to walls."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        self._distances = distance_to_occupied(grid)
        step = max(1, round(_COARSE / grid.resolution))
        cells = np.argwhere((grid.cells == FREE) & (self._distances > _CLEARANCE))
        self._places = grid.center_of(cells[np.all(cells % step == step // 2, axis=1)])

    def match(self, segment: ScanSegment, map_from_here: Pose) -> tuple[Pose, float]:
        """The pose (3,) that fits a segment best, and the gain in fit over the given pose (3,).

        The search is centred on the given pose. Fits are means over the end points: 1 on a wall, 1/2 at 0.1 m
        and 0 behind a wall.
        """
        points = segment.end_points()
        laser = segment.scans[0].laser
        candidates = self._coarsely(_thinned(points, _COARSE_POINTS), map_from_here, laser)
        points = _thinned(points, _FINE_POINTS)
        found = [self._finely(points, pose) for pose in (map_from_here, *candidates)]
        poses = np.array([map_from_here, *found])
        fits = self._fits_in_sight(segment, poses)
        best = int(np.argmax(fits))
        return poses[best], float(fits[best] - fits[0])

    def _coarsely(
        self, points: NDArray[np.float64], map_from_here: Pose, laser: NDArray[np.float64]
    ) -> list[Pose]:
        """The best non-adjacent poses around a given one (3,), with the laser at free places."""
        base_from_laser = np.array([*laser, 0.0])
        map_from_laser = compose(map_from_here, base_from_laser)
        places = self._places[np.hypot(*(self._places - map_from_laser[:2]).T) < _WINDOW]
        headings = map_from_laser[2] + np.arange(-_TURN_WINDOW, _TURN_WINDOW, _COARSE_TURN)
        tried = np.column_stack([np.repeat(places, len(headings), axis=0), np.tile(headings, len(places))])
        poses = compose(tried, inverse(base_from_laser))
        order = np.argsort(-self._fits(points, poses), kind="stable")
        left = poses[order[:_SHORTLIST]]
        chosen: list[Pose] = []
        while len(left) > 0 and len(chosen) < _CANDIDATES:
            chosen.append(left[0])
            left = left[np.hypot(*(left - left[0])[:, :2].T) > _APART]
        return chosen

    def _finely(self, points: NDArray[np.float64], pose: Pose) -> Pose:
        """The best pose of a lattice around a pose, refined by a lattice four times as fine."""
        for fineness in (1.0, 0.25):
            x, y, yaw = np.meshgrid(_FINE * _STEPS, _FINE * _STEPS, _FINE_TURN * _TURN_STEPS)
            poses = pose + fineness * np.column_stack([x.ravel(), y.ravel(), yaw.ravel()])
            pose = poses[np.argmax(self._fits(points, poses))]
        return pose

    def _fits_in_sight(self, segment: ScanSegment, map_from_here: Pose) -> NDArray[np.float64]:
        """(P,) fits of a segment at poses (P, 3); end points behind a wall do not fit at all."""
        count = -(-_FINE_POINTS // len(segment.scans))
        fits, returns = np.zeros(len(map_from_here)), 0
        for scan, here_from_base in zip(segment.scans, segment.here_from_base, strict=True):
            if len(scan) > 0:  # a covered laser measures nothing
                fits += len(scan) * self._fits_of_scan(scan, compose(map_from_here, here_from_base), count)
                returns += len(scan)
        return fits / max(returns, 1)

    def _fits_of_scan(self, scan: EndPoints, map_from_base: Pose, count: int) -> NDArray[np.float64]:
        """(P,) fits of at most ``count`` of a scan's end points at poses (P, 3) of its base."""
        points = scan.thinned(count).in_base
        x, y = (points - scan.laser).T
        bearings, ranges = np.arctan2(y, x), np.hypot(x, y)
        map_from_laser = compose(map_from_base, [*scan.laser, 0.0])
        walls = cast_ray_fan(self._grid, map_from_laser, bearings, ranges.max())
        is_seen = ranges < walls + _BEHIND
        fits = [
            self._fits(points[seen], pose[None])[0] for seen, pose in zip(is_seen, map_from_base, strict=True)
        ]
        return np.asarray(np.array(fits) * is_seen.mean(axis=1), dtype=np.float64)

    def _fits(self, points: NDArray[np.float64], map_from_base: Pose) -> NDArray[np.float64]:
        grid_from_base = between(self._grid.map_from_grid, map_from_base)
        return mean_fits(grid_from_base, points, self._distances, self._grid.resolution)


def _thinned(points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    return points[evenly(len(points), count)]
