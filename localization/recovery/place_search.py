"""Global search for poses where a scan fits, exhaustive over positions and headings.

First with few points, then with more where these fit. The likelihood field is wide enough for the grid
position nearest to the true one to fit.
"""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.floor.free_space import ANYWHERE, FreeSpace, Region
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.wall_surface import PRIOR
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field import distance_codes, log_table
from racecar.maps.geometry.se2 import Pose, compose

_SPACING = 0.2
"""Metres between positions. Chosen by judgement, since the nearest one is then at most 0.14 m from the true
one."""
_MOST_PLACES = 60_000
"""Most positions; on a larger map their spacing grows, so that the search stays short."""
_DEVIATION = 0.2
"""Standard deviation in metres of an end point from its wall. Chosen by judgement: the spacing of positions,
and the effect of the heading step on points ten metres away."""
_PIXEL = 0.1
"""Metres; as coarse as the deviation allows, since a raster that fits into the processor's cache is three
times as fast."""
_ROUGH_POINTS, _ROUGH_HEADINGS = 15, 80
"""Points and headings for all positions. Measured: with few points everywhere and more where they fit, the
search takes a third of the time."""
_LIKELY = 0.15
"""Share of positions then evaluated with more points. Chosen by judgement, as people may block some of the
few."""
_POINTS, _HEADINGS = 60, 160
"""Points and headings for likely positions. Chosen by judgement: headings are then 2.3° apart."""
_BEST = 4000
"""Number of best poses among which particles are drawn. Chosen by judgement: a fifth as many as particles."""
_COARSE_HEADINGS = 64
"""Headings for every fourth position, checked in parts while tracking: few, since the scan is then aligned
with walls within half a metre. Measured: with 128 no verdict on right and wrong maps differs."""
_FEW = 1000
"""Number of positions evaluated with all points at once, since selecting takes as long."""
_REACH = 1.5
"""Spacings beyond a region within which a position may represent a part of it, since one stands for a square
of that side and may be in any corner."""


class PlaceSearch:
    """Searches over positions all over a map."""

    def __init__(self, walls: Walls, free_space: FreeSpace) -> None:
        grid = free_space.grid
        self._pixel = max(_PIXEL, grid.resolution)
        self._codes = distance_codes(walls, free_space, self._pixel)
        self._log_by_code = log_table(_DEVIATION, PRIOR * grid.resolution)
        area = free_space.cell_count * grid.resolution**2
        self._spacing = max(_SPACING, np.sqrt(area / _MOST_PLACES))
        step = max(1, round(self._spacing / grid.resolution))
        cells = _lattice(free_space, step)
        # shuffled, so that each part covers the whole map
        coarse = np.flatnonzero((cells // step % 2 == 0).all(axis=1))
        self._coarse = np.random.default_rng(0).permutation(coarse)
        pixels = (cells + 0.5) * (grid.resolution / self._pixel) + 1.0  # the codes have a margin
        self._pixels = pixels.astype(np.int32)
        headings = np.full(len(cells), grid.map_from_grid[2])
        self._map_from_place = np.column_stack([grid.center_of(cells), headings])

    def find(
        self, points: EndPoints, count: int, rng: np.random.Generator, region: Region = ANYWHERE
    ) -> Pose:
        """(count, 3) base poses, spread over the positions in a region where a scan fits best."""
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
        """Number of coarse positions, every fourth, for `best_elsewhere`."""
        return len(self._coarse)

    def best_elsewhere(
        self, part: slice, points: EndPoints, point_in_map: NDArray[np.float64], apart: float, most: int
    ) -> Pose:
        """(M, 3) base poses at up to ``most`` positions of a part of the coarse ones, where a scan fits best.

        Each is farther than ``apart`` metres from a point (2,).
        """
        places = self._coarse[part]
        off = self._map_from_place[places, :2] - point_in_map
        places = places[np.hypot(off[:, 0], off[:, 1]) > apart]
        turned = self._turned(points.thinned(_ROUGH_POINTS), _COARSE_HEADINGS)
        best, turn = best_places(self._pixels[places], turned, self._codes, self._log_by_code, most)
        return self._map_from_base(places[best], turn / _COARSE_HEADINGS * (2.0 * np.pi), points)

    def _turned(self, points: EndPoints, headings: int) -> NDArray[np.int32]:
        """(headings, N, 2) rows and columns of points relative to the laser, for each heading of the base."""
        far = max(self._codes.shape)  # off the map from any position
        return turned_points((points.in_base - points.laser) / self._pixel, headings, far)

    def _scores(self, places: NDArray[np.int64], turned_points: NDArray[np.int32]) -> NDArray[np.float32]:
        """(P, H) log-likelihood of points (H, N, 2) at positions (P,), by index."""
        scores = np.empty((len(places), len(turned_points)), dtype=np.float32)
        score_places(self._pixels[places], turned_points, self._codes, self._log_by_code, scores)
        return scores

    def _map_from_base(
        self, places: NDArray[np.int64], turns: NDArray[np.float64], points: EndPoints
    ) -> Pose:
        """(P, 3) base poses with the laser at positions (P,), by index, and headings (P,) on the grid."""
        map_from_laser = self._map_from_place[places]
        map_from_laser[:, 2] += turns
        return compose(map_from_laser, [*-points.laser, 0.0])


def _in_two_threads(
    work: Callable[[NDArray[np.int64]], NDArray[Any]], places: NDArray[np.int64]
) -> NDArray[Any]:
    """Apply ``work``, whose kernels release the GIL, to both halves of positions (P,)."""
    with ThreadPoolExecutor(2) as pool:
        return np.concatenate(list(pool.map(work, np.array_split(places, 2))))


def _best(places: NDArray[np.int64], scores: NDArray[np.float32]) -> NDArray[np.float64]:
    """(M, 3) the best of scores (P, H): score, index of the position (P,), and index of the heading."""
    count = min(_BEST, scores.size)
    best = np.argpartition(scores.ravel(), scores.size - count)[scores.size - count :]
    place, heading = np.divmod(best, scores.shape[1])
    return np.column_stack([scores.ravel()[best], places[place], heading])


def _lattice(free_space: FreeSpace, step: int) -> NDArray[np.int64]:
    """(N, 2) row and column of open cells, one per block of ``step`` by ``step`` that has any."""
    found = []
    for rows in strips(free_space.is_open.shape, step):
        cells = np.argwhere(free_space.is_open[rows]) + np.array([rows.start, 0])
        middle = np.abs(cells % step - step // 2).sum(axis=1)
        order = np.argsort(middle, kind="stable")
        blocks = cells[order] // step
        _, first = np.unique(blocks[:, 0] * free_space.is_open.shape[1] + blocks[:, 1], return_index=True)
        found.append(cells[order][first])
    return np.concatenate(found)


@njit(cache=True, nogil=True)
def turned_points(points: NDArray[np.float64], headings: int, far: int) -> NDArray[np.int32]:
    """(headings, P, 2) rows and columns, clipped at ``far``, of points (P, 2) rotated to all headings."""
    turned = np.empty((headings, len(points), 2), dtype=np.int32)
    for heading in range(headings):
        angle = 2.0 * math.pi * heading / headings
        cos, sin = math.cos(angle), math.sin(angle)
        for k in range(len(points)):
            x, y = points[k]
            turned[heading, k, 0] = min(max(round(sin * x + cos * y), -far), far)
            turned[heading, k, 1] = min(max(round(cos * x - sin * y), -far), far)
    return turned


@njit(cache=True, nogil=True)
def score_places(
    places: NDArray[np.int32],
    turned_points: NDArray[np.int32],
    codes: NDArray[np.uint8],
    log_by_code: NDArray[np.float32],
    scores: NDArray[np.float32],
) -> None:
    """Fill scores (places, headings) with sums over points of the log-likelihood of their codes.

    ``places`` (N, 2) are rows and columns in ``codes``; ``turned_points`` (headings, P, 2) are relative to
    them.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    for n in range(len(places)):
        row, column = places[n]
        for heading in range(len(turned_points)):
            total = np.float32(0.0)
            for k in range(turned_points.shape[1]):
                r = min(max(row + turned_points[heading, k, 0], 0), last_row)
                c = min(max(column + turned_points[heading, k, 1], 0), last_column)
                total += log_by_code[codes[r, c]]
            scores[n, heading] = total


@njit(cache=True, nogil=True)
def best_places(
    places: NDArray[np.int32],
    turned_points: NDArray[np.int32],
    codes: NDArray[np.uint8],
    log_by_code: NDArray[np.float32],
    most: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (M,) of up to ``most`` places with the highest sums, in descending order, and of headings.

    The same sums as above, abandoned once they fall behind, as no code adds more than zero.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    best = np.full(most, -np.inf, dtype=np.float32)
    place, turn = np.zeros(most, dtype=np.int64), np.zeros(most, dtype=np.int64)
    for n in range(len(places)):
        row, column = places[n]
        highest, at = best[-1], -1
        for heading in range(len(turned_points)):
            total = np.float32(0.0)
            for k in range(turned_points.shape[1]):
                r = min(max(row + turned_points[heading, k, 0], 0), last_row)
                c = min(max(column + turned_points[heading, k, 1], 0), last_column)
                total += log_by_code[codes[r, c]]
                if total <= highest:
                    break
            if total > highest:
                highest, at = total, heading
        if at >= 0:
            rank = np.searchsorted(-best, -highest)
            for later in range(most - 1, rank, -1):
                best[later], place[later], turn[later] = best[later - 1], place[later - 1], turn[later - 1]
            best[rank], place[rank], turn[rank] = highest, n, at
    found = np.count_nonzero(best > -np.inf)
    return place[:found], turn[:found]
