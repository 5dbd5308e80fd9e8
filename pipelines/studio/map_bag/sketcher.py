"""Draws the map while it is built, seldom enough to cost mapping little."""

import time
from collections.abc import Callable
from functools import partial

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.studio.map_bag.news import Sketch

_EVERY = 0.5
"""Seconds between two sketches at least: by judgement, as often as one sees something new."""
_LEAST_WORK = 10.0
"""How many times as long as drawing the work between two sketches takes: watching costs a tenth at most."""


class Sketcher:
    """Looks at a mapper after each scan, and hands on what it draws."""

    def __init__(self, config: MappingConfig, hand_on: Callable[[Sketch], None]) -> None:
        self._new_grid = partial(GrowingGrid, config.resolution, config.rendering, config.growing_grid)
        self._growing = self._new_grid()
        self._mapper: Mapper | None = None
        self._hand_on = hand_on
        self._due = 0.0

    def watch(self, mapper: Mapper, scan: Scan, map_from_base: Pose) -> None:
        """Draw the map, if it is time and there is a keyframe."""
        began = time.monotonic()
        session = mapper.session()
        if began < self._due or not session.rays:
            return
        if mapper is not self._mapper:  # the run has begun anew
            self._growing, self._mapper = self._new_grid(), mapper
        grid = self._growing.draw(*mapper.seen_so_far())
        path, constraints = session.map_from_base, session.constraints.to_arrays()
        closed = constraints["keyframes"][session.constraints.are("loop_closure")]
        scan_in_map = transform_points(map_from_base, scan.points_in_base())
        self._hand_on(Sketch(grid, map_from_base, scan_in_map, path, path[closed, :2]))
        now = time.monotonic()
        self._due = now + max(_EVERY, _LEAST_WORK * (now - began))
