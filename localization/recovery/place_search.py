"""Where on a map does a scan fit? Every place and heading is tried: nothing is left to chance.

First with few points, then where these fit with more; on a likelihood field so wide that the place which is
tried nearest to the true one fits, too.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import ANYWHERE, FreeSpace, Region
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.recovery.place_search_kernels import best_places, score_places, turned_points
from racecar.localization.refinement.wall_surface import PRIOR
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field import distance_codes, log_table
from racecar.maps.geometry.se2 import Pose, compose

_SPACING = 0.2
"""Metres between the places that are tried: by judgement, since the one nearest to the true place is then
0.14 m beside it at most."""
_MOST_PLACES = 60_000
"""On a larger map they lie farther apart, so that the search stays short."""
_DEVIATION = 0.2
"""Metres of standard deviation of an end point from its wall: by judgement, that between places, and of what
turns between headings do to points ten metres off."""
_PIXEL = 0.1
"""Metres; as wide as the deviation allows, since a raster that fits into the processor's cache is looked up
three times as fast."""
_ROUGH_POINTS, _ROUGH_HEADINGS = 15, 80
"""With which all places are compared. Measured: with few points everywhere and more where they fit, the
search takes a third of the time."""
_LIKELY = 0.15
"""Share of the places that are then compared with more points: by judgement, as people may stop
some of the few."""
_POINTS, _HEADINGS = 60, 160
"""With which likely places are compared. By judgement: headings are then 2.3° apart."""
_BEST = 4000
"""Poses, the best, among which particles are drawn: by judgement, a fifth as many as particles."""
_COARSE_HEADINGS = 64
"""With which a part of every fourth place is compared, while the car is tracked: few, since the scan is then
laid on the walls, which takes it half a metre. Measured: with 128 no verdict on right and wrong maps
differs."""
_FEW = 1000
"""Places that are all compared with many points, since that takes no longer than to choose among them."""
_REACH = 1.5
"""Spacings beyond a region from which a place in it may be represented, since one stands for a square of that
side and may be in any corner."""


class PlaceSearch:
    """Knows places all over a map."""

    def __init__(self, walls: Walls, free_space: FreeSpace) -> None:
        grid = free_space.grid
        self._pixel = max(_PIXEL, grid.resolution)
        self._codes = distance_codes(walls, free_space, self._pixel)
        self._log_by_code = log_table(_DEVIATION, PRIOR * grid.resolution)
        area = free_space.cell_count * grid.resolution**2
        self._spacing = max(_SPACING, np.sqrt(area / _MOST_PLACES))
        step = max(1, round(self._spacing / grid.resolution))
        cells = _lattice(free_space, step)
        # in any order, so that each part is from all over the map
        coarse = np.flatnonzero((cells // step % 2 == 0).all(axis=1))
        self._coarse = np.random.default_rng(0).permutation(coarse)
        pixels = (cells + 0.5) * (grid.resolution / self._pixel) + 1.0  # the codes have a margin
        self._pixels = pixels.astype(np.int32)
        headings = np.full(len(cells), grid.map_from_grid[2])
        self._map_from_place = np.column_stack([grid.center_of(cells), headings])

    def find(
        self, points: EndPoints, count: int, rng: np.random.Generator, region: Region = ANYWHERE
    ) -> Pose:
        """(count, 3) poses of the base, spread over the places in a region where a scan fits best."""
        places = np.flatnonzero(region.contains(self._map_from_place[:, :2], _REACH * self._spacing))
        likely = max(int(np.ceil(_LIKELY * len(places))), _FEW)
        if likely < len(places):
            rough = self._turned(points.thinned(_ROUGH_POINTS), _ROUGH_HEADINGS)
            fits = _in_two_threads(lambda some: self._scores(some, rough).max(axis=1), places)
            places = places[np.argpartition(fits, len(fits) - likely)[-likely:]]
        fine = self._turned(points.thinned(_POINTS), _HEADINGS)
        best = _in_two_threads(lambda some: _best(some, self._scores(some, fine)), places)
        scores, place, turn = best[np.argsort(best[:, 0])[::-1][:_BEST]].T
        weights = np.exp(0.5 * (scores - scores[0]))
        chosen = np.append(
            np.arange(len(scores)),
            rng.choice(len(scores), max(count - len(scores), 0), p=weights / weights.sum()),
        )[:count]
        turns = (turn[chosen] + rng.uniform(-0.5, 0.5, count)) * (2.0 * np.pi / _HEADINGS)
        found = self._map_from_base(place[chosen].astype(np.int64), turns, points)
        found[:, :2] += rng.uniform(-0.5, 0.5, (count, 2)) * self._spacing
        return found

    @property
    def coarse_count(self) -> int:
        """Of the places of which `best_elsewhere` compares a part: every fourth."""
        return len(self._coarse)

    def best_elsewhere(
        self, part: slice, points: EndPoints, point_in_map: NDArray[np.float64], apart: float, most: int
    ) -> Pose:
        """(M, 3) poses of the base at ``most`` places, where a scan fits best of a part of the coarse ones.

        Each is farther than ``apart`` metres from a point (2,).
        """
        places = self._coarse[part]
        off = self._map_from_place[places, :2] - point_in_map
        places = places[np.hypot(off[:, 0], off[:, 1]) > apart]
        turned = self._turned(points.thinned(_ROUGH_POINTS), _COARSE_HEADINGS)
        best, turn = best_places(self._pixels[places], turned, self._codes, self._log_by_code, most)
        return self._map_from_base(places[best], turn / _COARSE_HEADINGS * (2.0 * np.pi), points)

    def _turned(self, points: EndPoints, headings: int) -> NDArray[np.int32]:
        """(headings, N, 2) rows and columns from the laser to points, for each way the base may face."""
        far = max(self._codes.shape)  # off the map from wherever on it
        return turned_points((points.in_base - points.laser) / self._pixel, headings, far)

    def _scores(self, places: NDArray[np.int64], turned_points: NDArray[np.int32]) -> NDArray[np.float32]:
        """(P, H) log-likelihood of points (H, N, 2) at places (P,), by number."""
        scores = np.empty((len(places), len(turned_points)), dtype=np.float32)
        score_places(self._pixels[places], turned_points, self._codes, self._log_by_code, scores)
        return scores

    def _map_from_base(
        self, places: NDArray[np.int64], turns: NDArray[np.float64], points: EndPoints
    ) -> Pose:
        """(P, 3) with the laser at places (P,), by number, and the base turned (P,) against the grid."""
        map_from_laser = self._map_from_place[places]
        map_from_laser[:, 2] += turns
        return compose(map_from_laser, [*-points.laser, 0.0])


def _in_two_threads(
    work: Callable[[NDArray[np.int64]], NDArray[Any]], places: NDArray[np.int64]
) -> NDArray[Any]:
    """What ``work``, whose loops release the GIL, makes of each half of places (P,)."""
    with ThreadPoolExecutor(2) as pool:
        return np.concatenate(list(pool.map(work, np.array_split(places, 2))))


def _best(places: NDArray[np.int64], scores: NDArray[np.float32]) -> NDArray[np.float64]:
    """(M, 3) the best of scores (P, H): each with its place, of places (P,), and its heading, by number."""
    count = min(_BEST, scores.size)
    best = np.argpartition(scores.ravel(), scores.size - count)[scores.size - count :]
    place, heading = np.divmod(best, scores.shape[1])
    return np.column_stack([scores.ravel()[best], places[place], heading])


def _lattice(free_space: FreeSpace, step: int) -> NDArray[np.int64]:
    """(N, 2) row and column of open cells, one in each block of ``step`` by ``step`` that has any."""
    found = []
    for rows in strips(free_space.is_open.shape, step):
        cells = np.argwhere(free_space.is_open[rows]) + np.array([rows.start, 0])
        middle = np.abs(cells % step - step // 2).sum(axis=1)
        order = np.argsort(middle, kind="stable")
        blocks = cells[order] // step
        _, first = np.unique(blocks[:, 0] * free_space.is_open.shape[1] + blocks[:, 1], return_index=True)
        found.append(cells[order][first])
    return np.concatenate(found)
