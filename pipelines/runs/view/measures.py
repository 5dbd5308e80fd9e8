"""Speed of the car, fit of its scans to the map, and certainty of its place, over the time of a run."""

from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED_THRESHOLD, OccupancyGrid
from racecar.pipelines.runs.view.scene import Scene

_ON_WALL = 0.1
"""Metres from a wall within which the end point of a beam fits it, as in report.json."""
_SPEED_WINDOW = 0.3
"""Seconds over which a speed is taken: at 40 scans per second single steps are mostly noise."""


class Measure(NamedTuple):
    """A quantity over the time of a drive."""

    name: str
    unit: str
    seconds: NDArray[np.float64]
    """(N,) since the start."""
    values: NDArray[np.float64]
    """(N,)"""
    is_bad_when_low: bool = False

    @property
    def worst(self) -> int:
        """Index of the worst value."""
        return int(np.argmin(self.values) if self.is_bad_when_low else np.argmax(self.values))


def measures_of(scene: Scene) -> list[Measure]:
    """Speed; fit, if there are scans and a map; and doubt, if it is known how certain the poses are."""
    measures = [_speed(scene)]
    if scene.grid is not None and any(len(sight.points_in_base) for sight in scene.sights):
        measures.append(_fit(scene, scene.grid))
    if np.any(scene.covariances):
        measures.append(Measure("doubt", "cm", scene.seconds, 100.0 * scene.deviations[:, 0]))
    elif len(scene.misses):
        order = np.argsort(scene.match_stamps, kind="stable")
        order = order[scene.match_stamps[order] >= scene.trajectory.stamps[0]]
        if len(order):
            seconds = scene.seconds_of(scene.match_stamps[order])
            measures.append(Measure("doubt", "cm", seconds, 100.0 * scene.misses[order]))
    return measures


def _speed(scene: Scene) -> Measure:
    """Metres per second, from the poses half a window before and after."""
    seconds, places = scene.seconds, scene.trajectory.map_from_base[:, :2]
    before = np.searchsorted(seconds, seconds - _SPEED_WINDOW / 2.0)
    after = np.minimum(np.searchsorted(seconds, seconds + _SPEED_WINDOW / 2.0), len(seconds) - 1)
    lasted = np.maximum(seconds[after] - seconds[before], 1e-9)
    return Measure("speed", "m/s", seconds, np.hypot(*(places[after] - places[before]).T) / lasted)


def _fit(scene: Scene, grid: OccupancyGrid) -> Measure:
    """Percent of the end points of each scan that are near a wall of the map."""
    is_wall = grid.cells >= round(100 * OCCUPIED_THRESHOLD)
    metres = grid.resolution * distance_transform_edt(~is_wall)
    fits = metres <= _ON_WALL + grid.resolution / 2.0
    shares = []
    seen = [len(sight.points_in_base) > 0 for sight in scene.sights]  # trimmed keyframes keep no points
    for sight, pose in zip(compress(scene.sights, seen), scene.poses_of_sights[seen], strict=True):
        cells = grid.cell_of(transform_points(pose, sight.points_in_base.astype(np.float64)))
        near = fits[tuple(cells[grid.contains(cells)].T)]
        shares.append(np.count_nonzero(near) / len(cells))
    stamps = np.array([sight.stamp for sight in scene.sights], dtype=np.int64)
    seconds = scene.seconds_of(stamps[seen])
    return Measure("fit", "%", seconds, 100.0 * np.array(shares), is_bad_when_low=True)
