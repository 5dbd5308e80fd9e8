"""A run as it is drawn: its map and path, and the car at one moment."""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.thinning import thinned
from racecar.pipelines.runs.view.scene import Scene
from racecar.pipelines.studio.layers import Layers
from racecar.pipelines.studio.map_image import known_extent
from racecar.pipelines.studio.outlines import cross
from racecar.pipelines.studio.palette import BY_DOUBT, BY_TIME, Shades
from racecar.pipelines.studio.watched_car import Glimpse

_FRESH = 1_500_000_000
"""Nanoseconds for which a scan or a particle cloud is shown; keyframes are about a second apart."""
_MISSED = 0.05
"""Residual in metres at which a match is drawn as most doubtful. Chosen by judgement: a cell."""
_DOUBTFUL_DEVIATION = 0.3
"""Standard deviation in metres of the position that is painted as most doubtful: about the car's width."""
_MARKER = 0.6
"""Size in metres of the cross at a doubtful place."""

_MOST_PLAN_CELLS = 1_000_000
"""Maximum cells of a floor plan, whose lines are dots: 60 x 40 m are drawn as finely as a map."""
_DRAWN = 50
"""Percent of black from which a cell of a plan is a line."""


class PathColor(str, Enum):
    """What the path's colour shows."""

    PLAIN = "one colour"
    TIME = "time"
    DOUBT = "doubt"


class ShownRun:
    """A run on layers of its own."""

    def __init__(self, scene: Scene, layers: Layers, offset: NDArray[np.float64]) -> None:
        """``offset`` (2,) is where the origin of the map is drawn."""
        self.scene, self._layers, self._offset = scene, layers, offset
        self.has_covariances = bool(np.any(scene.covariances))
        self._sight_stamps = np.array([sight.stamp for sight in scene.sights], dtype=np.int64)
        self._cloud_stamps = np.array([cloud.stamp for cloud in scene.clouds], dtype=np.int64)
        self._shown: int | None = None
        self._scale = 1.0
        """Scale at which the car was drawn."""
        self._draw_whole()

    @property
    def extent(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The corners (2,), (2,) of the known map and the path, as they are drawn."""
        low, high = extent_of(self.scene)
        return low + self._offset, high + self._offset

    def stamp_at(self, seconds: float, other: "ShownRun | None" = None) -> int:
        """The stamp of a moment, ``seconds`` after the start: of the other run, if both are of one time."""
        stamps = self.scene.trajectory.stamps
        begin = int(stamps[0])
        if other is not None:
            theirs = other.scene.trajectory.stamps
            begin = int(theirs[0]) if theirs[0] <= stamps[-1] and stamps[0] <= theirs[-1] else begin
        return begin + round(seconds * 1e9)

    def scan_of(self, stamp: int) -> int:
        """Number of the last scan until this stamp."""
        stamps = self.scene.trajectory.stamps
        return max(0, int(np.searchsorted(stamps, stamp, side="right")) - 1)

    def nearest(self, place: NDArray[np.float64]) -> tuple[float, float]:
        """How far the path is from a place (2,) as it is drawn, and at what second it is nearest."""
        apart = np.linalg.norm(self.scene.trajectory.map_from_base[:, :2] + self._offset - place, axis=1)
        return float(apart.min()), float(self.scene.seconds[np.argmin(apart)])

    def draw(self, stamp: int) -> bool:
        """Draw the car at a moment; returns whether that has changed."""
        scan, scale = self.scan_of(stamp), self._layers.car_scale
        if (scan, scale) == (self._shown, self._scale):
            return False
        self._shown, self._scale = scan, scale
        self._glimpse(scan).draw(self._layers)
        return True

    def words(self) -> str:
        """Where the car is at the shown moment, and what was not recorded of it."""
        scan = self._shown or 0
        trajectory = self.scene.trajectory
        pose, stamp = trajectory.map_from_base[scan], int(trajectory.stamps[scan])
        x, y = np.round(pose[:2], 2) + 0.0  # no "-0"
        words = f"x {x:.2f} m, y {y:.2f} m, heading {round(np.degrees(pose[2])):d}°"
        if self.has_covariances:
            place, heading = self.scene.deviations[scan]
            words += f"; ± {100 * place:.1f} cm, ± {np.degrees(heading):.1f}°"
        if self.scene.sights and _latest(self._sight_stamps, stamp) is None:
            words += "; no scan was recorded here"
        return words

    def draw_path(self, color: PathColor) -> None:
        """Colour the path."""
        shades, count = None, len(self.scene.trajectory)
        if color == PathColor.TIME:
            shades = Shades("path, early to late", BY_TIME, np.linspace(0.0, 1.0, count)[1:])
        elif color == PathColor.DOUBT:
            shades = Shades("path, sure to doubtful", BY_DOUBT, self._path_doubts()[1:])
        self._layers.line("path", self.scene.trajectory.map_from_base[:, :2], shades)

    def show(self, name: str, *, is_wanted: bool) -> None:
        """Show or hide a layer."""
        self._layers.show(name, is_wanted=is_wanted)

    def _draw_whole(self) -> None:
        """Draw the map, the path and the findings about them."""
        scene, layers = self.scene, self._layers
        if scene.grid is not None:
            layers.map(scene.grid)
        if scene.floor_plan is not None:
            layers.dots("floor_plan", _lines_of(scene.floor_plan))
        layers.segments("loops", scene.loops)
        missed = np.clip(scene.misses / _MISSED, 0.0, 1.0)
        words = f"match, missed by up to {100 * _MISSED:.0f} cm"
        layers.segments("matches", scene.matches, Shades(words, BY_DOUBT, missed))
        layers.dots("keyframes", scene.keyframes)
        places = [cross(doubt.place, _MARKER) for doubt in scene.doubts]
        layers.segments("doubts", np.array(places).reshape(-1, 2, 2))
        self.draw_path(PathColor.TIME)

    def _path_doubts(self) -> NDArray[np.float64]:
        """(S,) 0 to 1: the relative uncertainty of the estimate, and 1 in segments that the verdict names."""
        seconds = self.scene.seconds
        doubts = np.zeros(len(seconds))
        if self.has_covariances:
            doubts = np.minimum(self.scene.deviations[:, 0] / _DOUBTFUL_DEVIATION, 1.0)
        for doubt in self.scene.doubts:
            if doubt.seconds is not None:
                first, last = doubt.seconds
                doubts[(seconds >= first) & (seconds <= last)] = 1.0
        return doubts

    def _glimpse(self, scan: int) -> Glimpse:
        """The car at a scan, with what was recorded shortly before."""
        scene, trajectory = self.scene, self.scene.trajectory
        stamp, pose = int(trajectory.stamps[scan]), trajectory.map_from_base[scan]
        sight, cloud = _latest(self._sight_stamps, stamp), _latest(self._cloud_stamps, stamp)
        points = np.zeros((0, 2))
        if sight is not None:
            taken_from = trajectory.map_from_base[self.scan_of(scene.sights[sight].stamp)]
            points = transform_points(taken_from, scene.sights[sight].points_in_base)
        return Glimpse(
            pose,
            points,
            particles=None if cloud is None else scene.clouds[cloud].map_from_base,
            covariance=scene.covariances[scan] if self.has_covariances else None,
        )


def _lines_of(plan: OccupancyGrid) -> NDArray[np.float64]:
    """(N, 2) where a floor plan is drawn on."""
    plan = thinned(plan, _MOST_PLAN_CELLS)
    lines: NDArray[np.float64] = plan.center_of(np.argwhere(plan.cells >= _DRAWN))
    return lines


def extent_of(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The corners (2,), (2,) of the known map and the path."""
    known = None if scene.grid is None else known_extent(scene.grid)
    places = np.vstack([scene.trajectory.map_from_base[:, :2], *(known or ())])
    return places.min(axis=0), places.max(axis=0)


def _latest(stamps: NDArray[np.int64], stamp: int) -> int | None:
    """Index of the last stamp before this one, unless that is long past."""
    index = int(np.searchsorted(stamps, stamp, side="right")) - 1
    return index if index >= 0 and stamp - stamps[index] <= _FRESH else None
