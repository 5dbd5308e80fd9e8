"""Where on the whole map does a scan fit? Every place and heading is tried, so that nothing is left to luck.

The rows of the range table are what a laser would see all around from a cell: turned against the scan, one
row tells how well every heading fits there, without another trip to memory.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.tempering import likelihood_weights
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, CODE_OF_CELLS, FARTHEST
from racecar.localization.floor.range_table.range_table import RangeTable
from racecar.localization.numerics.two_threads import in_two_threads
from racecar.localization.recovery.lost_detector import ALIKE, ALIKE_SHARE, CLOSE, LIKENESS_QUANTILES
from racecar.localization.recovery.place_search_kernels import compare_views, fill_scores
from racecar.localization.sensor.beam_table import COURSE, beam_log_probabilities
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.ray_casting import cast_ray_fan

_SPACING = 0.2
"""Metres between the places that are tried; the sensor model forgives half of that."""
_MOST_PLACES = 60_000
_ROUGH_BEAMS, _BEAMS = 15, 60
_ROUGH_HEADINGS, _HEADINGS = 80, 160
"""At least so many are tried, or all there are."""
_LIKELY_PLACES = 0.15
"""Share of the places, by a few beams, that are tried with more."""
_HEADINGS_CAST = 128
_COMPARED = 60
_KEPT = 4000
"""Poses that are looked at closely."""


class PlaceSearch:
    """Knows what a laser sees from places all over a map."""

    def __init__(self, free_space: FreeSpace, table: RangeTable | None) -> None:
        """Without a range table, views from places that lie farther apart are cast."""
        self._grid = free_space.grid
        area = free_space.cell_count * self._grid.resolution**2
        self._spacing = max(_SPACING, np.sqrt(area / _MOST_PLACES))
        places = _lattice(free_space, max(1, round(self._spacing / self._grid.resolution)))
        self._map_from_place = np.column_stack([self._grid.center_of(places), np.zeros(len(places))])
        self._map_from_place[:, 2] = self._grid.map_from_grid[2]
        if table is not None:
            self._views = table.ranges
            self._view_of_place = table.cell_index[tuple(places.T)].astype(np.int64)
            self._map_from_place[:, :2] = self._grid.center_of(table.viewpoints[self._view_of_place] - 0.5)
        else:
            self._views = _cast_views(self._grid.resolution, free_space, self._map_from_place)
            self._view_of_place = np.arange(len(places))

    def shares_when_lost(self) -> NDArray[np.float64]:
        """(K, 4) shares of beams that agree closely, roughly, are stopped, look through: at wrong places.

        Views from places all over the map are taken for each other, each turned as fits best. The rows are
        of the pairs that look least alike up to those that look most alike.
        """
        chosen = np.linspace(0, len(self._view_of_place) - 1, _COMPARED).astype(np.int64)
        views = CELLS_OF_CODE[self._views[self._view_of_place[chosen]]].astype(np.float32)
        shares = compare_views(views, ALIKE / self._grid.resolution, ALIKE_SHARE, CLOSE)
        order = np.argsort(shares[:, 0] + shares[:, 1])
        edges = (LIKENESS_QUANTILES * len(order)).astype(np.int64)
        parts = [shares[order[first:end]] for first, end in pairwise(edges)]
        return np.array([part.mean(axis=0) for part in parts])

    def find(self, beams: Beams, squash: float, count: int, rng: np.random.Generator) -> Pose:
        """(count, 3) poses of the base, spread over the places where a scan fits best."""
        everywhere = np.arange(len(self._view_of_place))
        roughly = self._scores(everywhere, _ROUGH_HEADINGS, beams.thinned(_ROUGH_BEAMS), squash).max(axis=1)
        likely = int(np.ceil(_LIKELY_PLACES * len(roughly)))
        places = np.argpartition(roughly, len(roughly) - likely)[-likely:]
        scores = self._scores(places, _HEADINGS, beams.thinned(_BEAMS), squash)
        kept = min(_KEPT, scores.size)
        best = np.argpartition(scores.ravel(), scores.size - kept)[-kept:]
        best = best[np.argsort(scores.ravel()[best])[::-1]]
        weights = likelihood_weights(scores.ravel()[best], 0.5)
        chosen = np.concatenate([best, rng.choice(best, count - min(count, kept), p=weights)])
        place, heading = np.divmod(chosen[:count], scores.shape[1])
        spacing = 2.0 * np.pi / scores.shape[1]
        turned = np.column_stack([np.zeros((count, 2)), spacing * (heading + rng.uniform(-0.5, 0.5, count))])
        map_from_laser = compose(self._map_from_place[places[place]], turned)
        map_from_laser[:, :2] += rng.uniform(-0.5, 0.5, (count, 2)) * self._spacing
        return compose(map_from_laser, inverse(beams.base_from_laser))

    def _scores(
        self, places: NDArray[np.int64], fewest_headings: int, beams: Beams, squash: float
    ) -> NDArray[np.float32]:
        """(P, H) log-likelihood of a scan at places (P,), by number, and at every few headings."""
        log_probabilities = beam_log_probabilities(
            beams.ranges, beams.max_range, self._grid.resolution, squash, COURSE
        )
        headings = self._views.shape[1]
        offsets = np.rint(beams.bearings / (2.0 * np.pi) * headings).astype(np.int64) % headings
        step = 1 << int(np.log2(max(headings / fewest_headings, 1.0)))  # powers of two divide their number

        def fill(view_of_place: NDArray[np.int64]) -> NDArray[np.float32]:
            scores = np.empty((len(view_of_place), headings // step), dtype=np.float32)
            fill_scores(self._views, view_of_place, step, offsets, log_probabilities, scores)
            return scores

        return in_two_threads(fill, self._view_of_place[places])


def _lattice(free_space: FreeSpace, step: int) -> NDArray[np.int64]:
    """(N, 2) row and column of open cells, one in each block of ``step`` by ``step`` that has any."""
    cells = np.argwhere(free_space.is_open)
    middle = np.abs(cells % step - step // 2).sum(axis=1)
    order = np.argsort(middle, kind="stable")
    blocks = cells[order] // step
    _, first = np.unique(blocks[:, 0] * free_space.is_open.shape[1] + blocks[:, 1], return_index=True)
    return cells[order][first]


def _cast_views(resolution: float, free_space: FreeSpace, map_from_place: Pose) -> NDArray[np.uint8]:
    bearings = 2.0 * np.pi * np.arange(_HEADINGS_CAST) / _HEADINGS_CAST
    reach = CELLS_OF_CODE[-1] * resolution
    ranges = cast_ray_fan(free_space.grid, map_from_place, bearings, reach) / resolution
    return CODE_OF_CELLS[np.minimum(np.rint(ranges), FARTHEST).astype(np.int64)]
