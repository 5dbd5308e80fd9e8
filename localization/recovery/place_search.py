"""Where on the whole map does a scan fit? Every place and heading is tried: nothing is left to chance.

A row of the range table is what a laser would see all around from a place: turned against the scan, it gives
how well every heading fits there, without another load from memory.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.range_table.range_codes import RANGE_STEP, RangeCodes
from racecar.localization.floor.range_table.range_table import RangeTable
from racecar.localization.floor.region import ANYWHERE, Region
from racecar.localization.numerics.two_threads import in_two_threads
from racecar.localization.recovery.config import LostDetectorConfig, PlaceSearchConfig
from racecar.localization.recovery.lost_detector import LIKENESS_QUANTILES
from racecar.localization.recovery.place_search_kernels import compare_views, fill_scores
from racecar.localization.sensor.beam_table import beam_log_probabilities
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.ray_casting import cast_ray_fan

_HEADINGS_CAST = 128
"""Of the views that are cast where there is no range table, by judgement, since each has to be cast for every
place."""
_COMPARED_PLACES, _COMPARED_HEADINGS = 60, 80
"""Places that are taken for each other, and headings that are tried and compared at least; by judgement,
since their 3540 pairs leave 35 for the rarest group of likeness."""
_FEW = 1000
"""Places that are all compared with many beams, since that takes no longer than to choose among them."""
_REACH = 1.5
"""Spacings beyond a region from which a place in it may be represented, since one stands for a square of that
side and may be in any corner."""


class PlaceSearch:
    """Knows what a laser sees from places all over a map."""

    def __init__(
        self, free_space: FreeSpace, table: RangeTable | RangeCodes, config: PlaceSearchConfig
    ) -> None:
        """Without a range table, of which only the codes are known, views are cast."""
        self._config = config
        self._grid = free_space.grid
        area = free_space.cell_count * self._grid.resolution**2
        self._spacing = max(config.spacing, np.sqrt(area / config.most_places))
        places = _lattice(free_space, max(1, round(self._spacing / self._grid.resolution)))
        self._map_from_place = np.column_stack([self._grid.center_of(places), np.zeros(len(places))])
        self._map_from_place[:, 2] = self._grid.map_from_grid[2]
        if isinstance(table, RangeTable):
            self._codes, self._views = table.codes, table.ranges
            self._view_of_place = table.cell_index[tuple(places.T)].astype(np.int64)
            self._map_from_place[:, :2] = self._grid.center_of(table.viewpoints[self._view_of_place] - 0.5)
        else:
            self._codes, self._views = table, _cast_views(table, free_space, self._map_from_place)
            self._view_of_place = np.arange(len(places))

    def shares_when_lost(self, config: LostDetectorConfig) -> NDArray[np.float64]:
        """(K, 4) shares of beams that agree closely, roughly, are stopped, look through: at wrong places.

        Views from places all over the map are taken for each other, each turned as fits best. The rows are
        of the pairs that look least alike up to those that look most alike.
        """
        chosen = np.linspace(0, len(self._view_of_place) - 1, _COMPARED_PLACES).astype(np.int64)
        views = self._codes.steps[self._views[self._view_of_place[chosen]]].astype(np.float32)
        distance = config.agreement.distance / RANGE_STEP
        shares = compare_views(views, distance, config.agreement.share, config.close, _COMPARED_HEADINGS)
        order = np.argsort(shares[:, 0] + shares[:, 1])
        edges = (LIKENESS_QUANTILES * len(order)).astype(np.int64)
        groups = [shares[order[first:end]] for first, end in pairwise(edges)]
        return np.array([group.mean(axis=0) for group in groups])

    def find(
        self, beams: Beams, squash: float, count: int, rng: np.random.Generator, region: Region = ANYWHERE
    ) -> Pose:
        """(count, 3) poses of the base, spread over the places in a region where a scan fits best."""
        config = self._config
        places = np.flatnonzero(region.contains(self._map_from_place[:, :2], _REACH * self._spacing))
        rough_beams, fine_beams = beams.thinned(config.rough_beams), beams.thinned(config.beams)
        likely = max(int(np.ceil(config.likely_places * len(places))), _FEW)
        if likely < len(places):
            roughly = in_two_threads(
                lambda some: self._scores(some, config.rough_headings, rough_beams, squash).max(axis=1),
                places,
            )
            places = places[np.argpartition(roughly, len(roughly) - likely)[-likely:]]
        best = in_two_threads(
            lambda some: _best(some, self._scores(some, config.headings, fine_beams, squash), config.poses),
            places,
        )
        scores, place, turn = best[np.argsort(best[:, 0])[::-1][: config.poses]].T
        weights = np.exp(0.5 * (scores - scores[0]))
        chosen = np.append(
            np.arange(len(scores)),
            rng.choice(len(scores), max(count - len(scores), 0), p=weights / weights.sum()),
        )[:count]
        turns = turn[chosen] + rng.uniform(-0.5, 0.5, count)
        turned = np.column_stack([np.zeros((count, 2)), self._turn_of(config.headings) * turns])
        map_from_laser = compose(self._map_from_place[place[chosen].astype(np.int64)], turned)
        map_from_laser[:, :2] += rng.uniform(-0.5, 0.5, (count, 2)) * self._spacing
        return compose(map_from_laser, inverse(beams.base_from_laser))

    def _scores(
        self, places: NDArray[np.int64], fewest_headings: int, beams: Beams, squash: float
    ) -> NDArray[np.float32]:
        """(P, H) log-likelihood of a scan at places (P,), by number, and at every few headings."""
        log_probabilities = beam_log_probabilities(
            beams.ranges, beams.max_range, squash, self._config.beam_model, self._codes
        )
        headings, step = self._views.shape[1], self._step_of(fewest_headings)
        offsets = np.rint(beams.bearings / (2.0 * np.pi) * headings).astype(np.int64) % headings
        scores = np.empty((len(places), headings // step), dtype=np.float32)
        fill_scores(self._views, self._view_of_place[places], step, offsets, log_probabilities, scores)
        return scores

    def _step_of(self, fewest_headings: int) -> int:
        """Of how many headings one is tried: a power of two, which divides their number."""
        return 1 << int(np.log2(max(self._views.shape[1] / fewest_headings, 1.0)))

    def _turn_of(self, fewest_headings: int) -> float:
        """Radians between two that are tried."""
        return 2.0 * np.pi * self._step_of(fewest_headings) / int(self._views.shape[1])


def _best(places: NDArray[np.int64], scores: NDArray[np.float32], most: int) -> NDArray[np.float64]:
    """(M, 3) the best of scores (P, H): each with its place, of places (P,), and its heading, by number."""
    count = min(most, scores.size)
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


def _cast_views(codes: RangeCodes, free_space: FreeSpace, map_from_place: Pose) -> NDArray[np.uint8]:
    bearings = 2.0 * np.pi * np.arange(_HEADINGS_CAST) / _HEADINGS_CAST
    return codes.encode(cast_ray_fan(free_space.grid, map_from_place, bearings, codes.longest_range))
