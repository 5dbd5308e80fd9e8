"""Render the occupancy grid afresh from the optimized poses: ray casting with odds for hits and passes.

Moravec and Elfes, "High resolution maps from wide angle sonar", ICRA 1985; the odds of a cell are those of
independent looks at it.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import side_by_side
from racecar.mapping.grid.rendering_kernels import cast_scan
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.sensing.scan import Scan

_LOG_ODDS_HIT = np.log(0.75 / 0.25)
_LOG_ODDS_PASS = np.log(0.40 / 0.60)
_CLEARED_BY_MISS = 5.0
_LONGEST_RAY = 60.0
_MARGIN = 1.0
_ORIGIN = np.zeros((1, 2), dtype=np.int16)
_STEP = np.float32(0.002)
"""Metres, finer than lasers measure; 16 bits of them reach farther than the longest ray."""


@dataclass(frozen=True, eq=False)
class Rays:
    """What one scan tells about the floor, in the laser frame at its stamp."""

    packed: NDArray[np.uint8]
    """(B,) the way from each end to the next in steps of 2 mm, compressed: a quarter of the ends' memory."""
    returns: int
    """How many of the ends are returns."""

    @classmethod
    def to(cls, ends: NDArray[np.floating[Any]], returns: int) -> "Rays":
        """Rays to ends (N, 2) in metres, at most 65 m away, of which so many are returns."""
        steps = np.rint(ends / _STEP).astype(np.int16)
        from_last = np.diff(steps, axis=0, prepend=_ORIGIN)
        return cls(np.frombuffer(zlib.compress(from_last.tobytes(), level=1), dtype=np.uint8), returns)

    @property
    def ends(self) -> NDArray[np.float32]:
        """(N, 2) metres: end points of the returns, then of the stretch that each miss shows to be free."""
        from_last = np.frombuffer(zlib.decompress(self.packed.data), dtype=np.int16).reshape(-1, 2)
        return np.cumsum(from_last, axis=0, dtype=np.int16) * _STEP


NO_RAYS = Rays.to(np.zeros((0, 2)), 0)
"""Of a scan that was given up."""


def rays_of(scan: Scan, points_in_laser: NDArray[np.float64]) -> Rays:
    """The rays of a scan whose returns, corrected for motion, are ``points_in_laser`` (M, 2).

    A miss may be glass or black paint as well as open space, so it clears only the first metres.
    """
    missed = scan.bearings[np.isposinf(scan.ranges)]
    length = min(_CLEARED_BY_MISS, scan.max_range)
    free = length * np.column_stack([np.cos(missed), np.sin(missed)])
    near = points_in_laser[np.hypot(points_in_laser[:, 0], points_in_laser[:, 1]) < _LONGEST_RAY]
    return Rays.to(np.concatenate([near, free]), len(near))


def not_given_up(rays: Sequence[Rays], keyframes: range) -> list[int]:
    """Those of some keyframes that have rays."""
    return [k for k in keyframes if rays[k] is not NO_RAYS]


def pack_rays(rays: list[Rays]) -> None:
    """Lay rays side by side."""
    held = not_given_up(rays, range(len(rays)))
    for k, packed in zip(held, side_by_side([rays[k].packed for k in held]), strict=True):
        rays[k] = Rays(packed, rays[k].returns)


def returns_of(rays: Sequence[Rays], map_from_laser: Pose) -> list[NDArray[np.float64]]:
    """Per keyframe (N, 2) metres in the map: the returns among rays (K) seen from poses (K, 3)."""
    return [
        transform_points(pose, ray.ends[: ray.returns])
        for pose, ray in zip(map_from_laser, rays, strict=True)
    ]


def render(rays: Sequence[Rays], map_from_laser: Pose, resolution: float) -> OccupancyGrid:
    """The grid that rays (K) seen from poses (K, 3) draw."""
    ends = [transform_points(pose, ray.ends) for pose, ray in zip(map_from_laser, rays, strict=True)]
    corners = np.array([e.min(axis=0) for e in ends if len(e)] + [e.max(axis=0) for e in ends if len(e)])
    corners = np.concatenate([corners, map_from_laser[:, :2]])
    low = np.floor((corners.min(axis=0) - _MARGIN) / resolution) * resolution
    columns, rows = np.ceil((corners.max(axis=0) + _MARGIN - low) / resolution).astype(np.int64)
    hits, passes = np.zeros((rows, columns), dtype=np.uint16), np.zeros((rows, columns), dtype=np.uint16)
    marks = np.full((rows, columns), -1, dtype=np.int32)
    for mark, (pose, ray, end) in enumerate(zip(map_from_laser, rays, ends, strict=True)):
        column, row = (pose[:2] - low) / resolution
        is_hit = np.arange(len(end)) < ray.returns
        cast_scan(column, row, (end - low) / resolution, is_hit, mark, marks, hits, passes)
    return OccupancyGrid(occupancy(hits, passes), resolution, np.array([low[0], low[1], 0.0]))


def occupancy(hits: NDArray[np.uint16], passes: NDArray[np.uint16]) -> NDArray[np.int8]:
    """Percent occupied, or unknown, of cells that so many scans hit and passed."""
    log_odds = _LOG_ODDS_HIT * hits + _LOG_ODDS_PASS * passes
    percent = np.rint(100.0 / (1.0 + np.exp(-np.clip(log_odds, -20.0, 20.0))))
    return np.where(hits + passes > 0, percent, UNKNOWN).astype(np.int8)
