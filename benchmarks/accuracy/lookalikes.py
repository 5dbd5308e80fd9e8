"""Places that a single scan, and so no filter, can distinguish at once: found by comparing exact scans."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.lookalike_kernels import best_agreement
from racecar.maps.geometry.se2 import Pose, compose, wrap_angle
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_ray_fan

_SPACING = 0.25
"""Metres between the compared places."""
_HEADINGS = 180
_BEAMS = 90
_REACH = 30.0
_ELSEWHERE = 1.0
"""Metres; anything nearer is the same place."""
_TURNED = np.radians(30.0)
_WITHIN, _WITHIN_SHARE = 0.2, 0.03
"""Metres, and share of the range, within which two ranges agree, given the spacing of the compared places and
headings."""
_LOOKS_ALIKE = 0.85
"""Share of the beams that must agree."""


class Lookalikes:
    """The exact scans from places all over a map."""

    def __init__(self, grid: OccupancyGrid) -> None:
        is_place = (grid.cells == FREE) & (distance_to_occupied(grid) > 0.15)
        step = max(1, round(_SPACING / grid.resolution))
        cells = np.argwhere(is_place)
        cells = cells[np.all(cells % step == step // 2, axis=1)]
        self._grid = grid
        self._places = grid.center_of(cells)
        poses = np.column_stack([self._places, np.zeros(len(cells))])
        bearings = 2.0 * np.pi * np.arange(_HEADINGS) / _HEADINGS
        self._views = cast_ray_fan(grid, poses, bearings, _REACH).clip(0.0, _REACH).astype(np.float32)

    def has(self, map_from_base: Pose, base_from_laser: Pose, bearings: NDArray[np.float64]) -> bool:
        """Whether the scan from a pose (3,) looks almost the same at another place or another heading."""
        seen_along = bearings[np.linspace(0, len(bearings) - 1, _BEAMS).astype(int)]
        map_from_laser = compose(map_from_base, base_from_laser)
        scan = cast_ray_fan(self._grid, map_from_laser[None], seen_along, _REACH)[0].clip(0.0, _REACH)
        agreement = best_agreement(
            self._views,
            scan.astype(np.float32),
            seen_along / (2.0 * np.pi) * _HEADINGS,
            _WITHIN,
            _WITHIN_SHARE,
        )
        share, heading = agreement[:, 0], agreement[:, 1] * 2.0 * np.pi / _HEADINGS
        is_elsewhere = np.hypot(*(self._places - map_from_laser[:2]).T) > _ELSEWHERE
        is_turned = np.abs(wrap_angle(heading - map_from_laser[2])) > _TURNED
        return bool(np.any(share[is_elsewhere | is_turned] >= _LOOKS_ALIKE))
