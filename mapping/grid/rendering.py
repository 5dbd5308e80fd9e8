"""The occupancy grid, rendered from the optimized poses: ray casting with log odds for hits and passes.

Moravec and Elfes, "High resolution maps from wide angle sonar", ICRA 1985; looks of different scans at a cell
count as independent.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import side_by_side
from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.rendering_kernels import cast_misses, cast_returns
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.occupancy_grid import FREE_THRESHOLD, UNKNOWN, OccupancyGrid
from racecar.maps.sensing.scan import Scan

_ORIGIN = np.zeros((1, 2), dtype=np.int16)
"""Where the steps of rays begin by definition: the laser."""
_STEP = np.float32(0.002)
"""Metres, finer than lasers measure; it is that coarse so that 16 bits reach farther than the longest ray."""
Box = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Lower left and upper right (2,), metres in the map."""
LONGEST_RAY = 65.5
"""Metres that an end may be away along an axis, since 16 bits reach 65.534 m."""
_SURE = 20.0
"""Log odds beyond which a cell is 0 or 100 percent occupied anyway, so that the exponential stays finite."""


@dataclass(frozen=True, eq=False)
class Rays:
    """What one scan says about the floor, in the laser frame at its stamp; of some scans, no rays are
    kept."""

    packed: NDArray[np.uint8]
    """(B,) the steps from each end to the next in units of 2 mm, compressed: a quarter of the ends' memory.
    Empty where no rays are kept."""
    returns: int
    """How many of the ends are returns."""

    @classmethod
    def to(cls, ends: NDArray[np.floating[Any]], returns: int) -> "Rays":
        """Rays to ends (N, 2) in metres, at most 65 m away, of which the first ``returns`` are returns."""
        if len(ends) == 0:
            return cls.none()
        steps = np.rint(ends / _STEP).astype(np.int16)
        from_last = np.diff(steps, axis=0, prepend=_ORIGIN)
        return cls(np.frombuffer(zlib.compress(from_last.tobytes(), level=1), dtype=np.uint8), returns)

    @classmethod
    def none(cls) -> "Rays":
        """Of a scan that saw nothing, or whose rays were trimmed."""
        return cls(np.zeros(0, dtype=np.uint8), 0)

    @property
    def are_kept(self) -> bool:
        """Whether there are any."""
        return len(self.packed) > 0

    @property
    def ends(self) -> NDArray[np.float32]:
        """(N, 2) metres: end points of the returns, then of what each miss shows to be free."""
        unpacked = zlib.decompress(self.packed.data) if self.are_kept else b""
        from_last = np.frombuffer(unpacked, dtype=np.int16).reshape(-1, 2)
        return np.cumsum(from_last, axis=0, dtype=np.int16) * _STEP


def rays_of(scan: Scan, points_in_laser: NDArray[np.float64], config: RenderingConfig) -> Rays:
    """The rays of a scan whose returns, corrected for motion, are ``points_in_laser`` (M, 2)."""
    distances = np.hypot(points_in_laser[:, 0], points_in_laser[:, 1])
    near = points_in_laser[distances < config.longest_ray]
    return Rays.to(np.concatenate([near, _cleared_by_misses(scan, config)]), len(near))


def _cleared_by_misses(scan: Scan, config: RenderingConfig) -> NDArray[np.float64]:
    """(N, 2) how far the misses of a scan show the floor to be free, in the laser frame.

    Some lasers lose single beams at random, which shows nothing; where open space, glass or black paint
    swallows them, it swallows their neighbours too. Between two returns that leave no room for an opening,
    misses clear no farther than the nearer of both. The ends of the view bound an opening like returns.
    """
    missed = scan.bearings[np.isposinf(scan.ranges)]
    bearings, ranges = scan.bearings[scan.is_return], scan.ranges[scan.is_return]
    bounds = np.concatenate([scan.bearings[:1], bearings, scan.bearings[-1:]])
    ranges = np.concatenate([[np.inf], ranges, [np.inf]])
    after = np.searchsorted(bearings, missed) + 1
    nearer = np.minimum(ranges[after - 1], ranges[after])
    is_opening = bounds[after] - bounds[after - 1] >= config.narrowest_opening / nearer
    length = min(config.cleared_by_miss, scan.max_range)
    lengths = np.where(is_opening, length, np.minimum(nearer, length))
    return np.column_stack([lengths * np.cos(missed), lengths * np.sin(missed)])


def kept(rays: Sequence[Rays], keyframes: range) -> list[int]:
    """Those of some keyframes whose rays are kept."""
    return [k for k in keyframes if rays[k].are_kept]


def pack_rays(rays: list[Rays]) -> None:
    """Lay rays side by side in memory."""
    keyframes = kept(rays, range(len(rays)))
    for k, packed in zip(keyframes, side_by_side([rays[k].packed for k in keyframes]), strict=True):
        rays[k] = Rays(packed, rays[k].returns)


def returns_of(rays: Sequence[Rays], map_from_laser: Pose) -> list[NDArray[np.float64]]:
    """Per keyframe (N, 2) metres in the map: the returns among rays (K) seen from poses (K, 3)."""
    return [
        transform_points(pose, ray.ends[: ray.returns])
        for pose, ray in zip(map_from_laser, rays, strict=True)
    ]


def render(
    rays: Sequence[Rays],
    map_from_laser: Pose,
    drives: NDArray[np.int32],
    resolution: float,
    config: RenderingConfig,
    box: Box | None = None,
) -> OccupancyGrid:
    """The grid that rays (K) seen from poses (K, 3) draw, with cells of ``resolution`` metres: all that they
    touch, with a margin, or what of it lies in a ``box``. Where drives (K,) see otherwise than those of lower
    numbers did, the cells are as these see them."""
    touched = [touched_by(ray, pose) for pose, ray in zip(map_from_laser, rays, strict=True)]
    low, high = seen_box(touched, config.margin)
    if box is not None:
        low, high = np.maximum(low, box[0]), np.minimum(high, box[1])
    low = np.floor(low / resolution) * resolution
    columns, rows = np.ceil((high - low) / resolution).astype(np.int64)
    hits, passes = np.zeros((rows, columns), dtype=np.uint16), np.zeros((rows, columns), dtype=np.uint16)
    marks = np.full((rows, columns), -1, dtype=np.int32)
    mark = 0
    for points in touched:  # in place, because a day's rays take hundreds of megabytes
        points -= low
        points /= resolution
    for drive in np.unique(drives):
        scans = np.flatnonzero(drives == drive).tolist()
        cells, returns = [touched[k] for k in scans], [rays[k].returns for k in scans]
        settle(hits, passes, config)
        cast(cells, returns, mark, marks, hits, passes, config)
        mark += 2 * len(scans)
    return OccupancyGrid(occupancy(hits, passes, config), resolution, np.array([low[0], low[1], 0.0]))


def seen_box(touched: Sequence[NDArray[np.float64]], margin: float) -> Box:
    """What contains all that scans touched, at least one, with a margin in metres."""
    corners = np.array(
        [points.min(axis=0) for points in touched] + [points.max(axis=0) for points in touched]
    )
    return corners.min(axis=0) - margin, corners.max(axis=0) + margin


def touched_by(rays: Rays, map_from_laser: Pose) -> NDArray[np.float64]:
    """(N + 1, 2) metres in the map: the ends of rays seen from a pose (3,), and last their start."""
    return np.concatenate([transform_points(map_from_laser, rays.ends), map_from_laser[None, :2]])


def cast(
    touched: Sequence[NDArray[np.float64]],
    returns: Sequence[int],
    mark: int,
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    config: RenderingConfig,
) -> None:
    """Count the cells that scans (K) hit and passed, by what each touched, as `touched_by` but in cells.

    Returns come first, because a miss ends where they show a wall: it may have been lost there, on glass or
    black paint, and shows nothing of what lies behind. In ``marks`` (rows, columns), cells remember the last
    scan that touched them, by numbers of which those from ``mark`` on were not used before, 2 K of them.
    """
    for k, (cells, count) in enumerate(zip(touched, returns, strict=True), start=mark):
        column, row = cells[-1]
        cast_returns(column, row, cells[:count], k, marks, hits, passes)
    passes_per_hit = float(-_log_odds(config.hit_probability) / _log_odds(config.pass_probability))
    for k, (cells, count) in enumerate(zip(touched, returns, strict=True), start=mark + len(touched)):
        if count < len(cells) - 1:
            column, row = cells[-1]
            cast_misses(column, row, cells[:-1], count, k, marks, hits, passes, passes_per_hit)


def settle(hits: NDArray[np.uint16], passes: NDArray[np.uint16], config: RenderingConfig) -> None:
    """Let what was counted so far (rows, columns) speak no louder than `settled_probability`, before a later
    drive counts: clamped, evidence is forgotten where something contradicts it and nowhere else (Yguel,
    Aycard and Laugier, "Update policy of dense maps", 2008)."""
    per_hit, per_pass = _log_odds(config.hit_probability), _log_odds(config.pass_probability)
    bound = _log_odds(config.settled_probability)
    seen = np.nonzero(hits + passes)
    log_odds = np.clip(per_hit * hits[seen] + per_pass * passes[seen], -bound, bound)
    hits[seen] = np.where(log_odds > 0.0, np.maximum(np.rint(log_odds / per_hit), 1.0), 0.0)
    passes[seen] = np.where(log_odds > 0.0, 0.0, np.maximum(np.rint(log_odds / per_pass), 1.0))


def occupancy(
    hits: NDArray[np.uint16], passes: NDArray[np.uint16], config: RenderingConfig
) -> NDArray[np.int8]:
    """Percent occupied, or unknown, of cells that so many scans hit and passed."""
    log_odds = _log_odds(config.hit_probability) * hits + _log_odds(config.pass_probability) * passes
    percent = np.rint(100.0 / (1.0 + np.exp(-np.clip(log_odds, -_SURE, _SURE))))
    return np.where(hits + passes > 0, percent, UNKNOWN).astype(np.int8)


def looks_until_free(config: RenderingConfig) -> int:
    """How many scans must pass a cell until it counts as free."""
    return int(np.ceil(_log_odds(FREE_THRESHOLD) / _log_odds(config.pass_probability)))


def _log_odds(probability: float) -> np.float64:
    return np.float64(np.log(probability / (1.0 - probability)))
