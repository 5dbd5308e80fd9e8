"""Draw the map while it is built, rarely enough not to slow down mapping."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.mapping.session.session import Session
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.thinning import thinned
from racecar.pipelines.studio.watched_car import Glimpse
from racecar.sensors.scan import Scan

_EVERY = 0.5
"""Minimum seconds between two sketches. Chosen by judgement: as often as something new is visible."""
_MOST_CELLS = 16_000_000
"""Maximum cells of a map that is sent, which is all that the page shows."""
_LEAST_WORK, _LONGEST_PAUSE = 10.0, 3.0
"""Minimum ratio of the time between drawings to that of drawing the map, so that watching costs a tenth; and
its limit in seconds, since the first drawing may compile its loops."""


def finished_sketch(result: MappingResult) -> tuple[OccupancyGrid, Glimpse]:
    """The map as it was written, with the car at the end of its drive."""
    end = _glimpse(result.trajectory.map_from_base[-1], np.zeros((0, 2)), result.session)
    return thinned(result.tiled, _MOST_CELLS), end


def _glimpse(map_from_base: Pose, scan_in_map: NDArray[np.float64], session: Session) -> Glimpse:
    path, keyframes = session.map_from_base, session.constraints.to_arrays()["keyframes"]
    loops = path[keyframes[session.constraints.are("loop_closure")], :2]
    return Glimpse(map_from_base, scan_in_map, path, loops=loops)


class Sketcher:
    """Watches a mapper after each scan, and sends drawings of it."""

    def __init__(self, config: MappingConfig, hand_on: Callable[[OccupancyGrid | Glimpse], None]) -> None:
        self._new_grid = partial(GrowingGrid, config.resolution, config.rendering)
        self._growing = self._new_grid()
        self._mapper: Mapper | None = None
        self._hand_on = hand_on
        self._sketch_due = self._grid_due = 0.0

    def watch(self, mapper: Mapper, scan: Scan, map_from_base: Pose) -> None:
        """Draw what is due, once there is a keyframe."""
        if time.monotonic() < self._sketch_due or not mapper.growth.keyframes:
            return
        if (grid := self._draw(mapper)) is not None:
            self._hand_on(grid)
        scan_in_map = transform_points(map_from_base, scan.points_in_base())
        self._hand_on(_glimpse(map_from_base, scan_in_map, mapper.session()))
        self._sketch_due = time.monotonic() + _EVERY

    def _draw(self, mapper: Mapper) -> OccupancyGrid | None:
        """The map, if it is due."""
        began = time.monotonic()
        if mapper is not self._mapper:  # the run has restarted
            self._growing, self._mapper, self._grid_due = self._new_grid(), mapper, began
        if began < self._grid_due:
            return None
        grid = self._growing.draw(*mapper.seen_so_far())
        now = time.monotonic()
        self._grid_due = now + min(_LEAST_WORK * (now - began), _LONGEST_PAUSE)
        return grid
