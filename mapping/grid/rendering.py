"""Render the occupancy grid from optimized poses by casting the rays of scans into tiles."""

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.evidence import Evidence, tiles_touched
from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.tiled_grid import TiledGrid, tiles_in
from racecar.sensors.arrays import side_by_side
from racecar.sensors.scan import Scan

_ORIGIN = np.zeros((1, 2), dtype=np.int16)
"""Start of a packed ray, by definition: the laser."""
_STEP = np.float32(0.002)
"""Metres per unit, finer than lasers measure, and coarse enough so that 16 bits exceed the longest ray."""
_CLEARED_BY_MISS = 5.0
"""Metres that a beam without a return clears, no more because it may have hit glass or black paint."""
_NARROWEST_OPENING = 0.5
"""Metres between two neighbouring returns, across the beams; in narrower openings, misses between them clear
no farther than the nearer one. Chosen by judgement: less than any doorway. Measured in a simulated building,
of a laser that loses half of its beams: 8 m² of false floor from 0.25 to 1 m, 200 m² at 0."""
Box = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Lower left and upper right (2,), metres in the map."""
LONGEST_RAY = 65.5
"""Largest coordinate of an end in metres, since 16 bits reach 65.534 m."""


@dataclass(frozen=True, eq=False)
class Rays:
    """What one scan says about the floor, in the laser frame at its stamp; trimmed scans keep no rays."""

    packed: NDArray[np.uint8]
    """(B,) compressed differences of successive ends in units of 2 mm: a quarter of the ends' memory. Empty
    where no rays are kept."""
    returns: int
    """Number of ends that are returns."""

    @classmethod
    def to(cls, ends: NDArray[np.floating[Any]], returns: int) -> "Rays":
        """Pack ends (N, 2) in metres, at most 65 m away, of which the first ``returns`` are returns."""
        if len(ends) == 0:
            return cls.none()
        steps = np.rint(ends / _STEP).astype(np.int16)
        from_last = np.diff(steps, axis=0, prepend=_ORIGIN)
        return cls(np.frombuffer(zlib.compress(from_last.tobytes(), level=1), dtype=np.uint8), returns)

    @classmethod
    def none(cls) -> "Rays":
        """The rays of a scan that saw nothing or was trimmed."""
        return cls(np.zeros(0, dtype=np.uint8), 0)

    @property
    def are_kept(self) -> bool:
        """Whether there are any rays."""
        return len(self.packed) > 0

    @property
    def ends(self) -> NDArray[np.float32]:
        """(N, 2) metres: end points of the returns, then those of the misses' free space."""
        unpacked = zlib.decompress(self.packed.data) if self.are_kept else b""
        from_last = np.frombuffer(unpacked, dtype=np.int16).reshape(-1, 2)
        return np.cumsum(from_last, axis=0, dtype=np.int16) * _STEP


def rays_of(scan: Scan, points_in_laser: NDArray[np.float64], config: RenderingConfig) -> Rays:
    """The rays of a scan with deskewed returns ``points_in_laser`` (M, 2)."""
    distances = np.hypot(points_in_laser[:, 0], points_in_laser[:, 1])
    near = points_in_laser[distances < config.longest_ray]
    return Rays.to(np.concatenate([near, _cleared_by_misses(scan)]), len(near))


def _cleared_by_misses(scan: Scan) -> NDArray[np.float64]:
    """(N, 2) ends of the free space that misses of a scan show, in the laser frame.

    Some lasers lose single beams at random, which shows nothing. Open space, glass or black paint swallows
    neighbouring beams too. So misses between two returns that are too close for an opening clear no farther
    than the nearer one. The ends of the field of view bound an opening like returns.
    """
    missed = scan.bearings[np.isposinf(scan.ranges)]
    bearings, ranges = scan.bearings[scan.is_return], scan.ranges[scan.is_return]
    bounds = np.concatenate([scan.bearings[:1], bearings, scan.bearings[-1:]])
    ranges = np.concatenate([[np.inf], ranges, [np.inf]])
    after = np.searchsorted(bearings, missed) + 1
    nearer = np.minimum(ranges[after - 1], ranges[after])
    is_opening = bounds[after] - bounds[after - 1] >= _NARROWEST_OPENING / nearer
    length = min(_CLEARED_BY_MISS, scan.max_range)
    lengths = np.where(is_opening, length, np.minimum(nearer, length))
    return np.column_stack([lengths * np.cos(missed), lengths * np.sin(missed)])


def kept(rays: Sequence[Rays], keyframes: range) -> list[int]:
    """Those of some keyframes whose rays are kept."""
    return [k for k in keyframes if rays[k].are_kept]


def pack_rays(rays: list[Rays]) -> None:
    """Move rays into one block of memory."""
    keyframes = kept(rays, range(len(rays)))
    for k, packed in zip(keyframes, side_by_side([rays[k].packed for k in keyframes]), strict=True):
        rays[k] = Rays(packed, rays[k].returns)


def returns_of(rays: Sequence[Rays], map_from_laser: Pose) -> Iterator[NDArray[np.float64]]:
    """Yield, per keyframe, returns (N, 2) in metres in the map, of rays (K) from poses (K, 3)."""
    for pose, ray in zip(map_from_laser, rays, strict=True):
        yield transform_points(pose, ray.ends[: ray.returns])


def render(
    rays: Sequence[Rays],
    map_from_laser: Pose,
    drives: NDArray[np.int32],
    resolution: float,
    config: RenderingConfig,
    box: Box | None = None,
) -> TiledGrid:
    """Render rays (K) from poses (K, 3) with cells of ``resolution`` metres: everything they touch plus a
    margin, or the part in a ``box``. Where drives (K,) disagree, later ones win."""
    bounds = bounds_of(rays, map_from_laser)
    low, high = seen_box(bounds, config.margin)
    if box is not None:
        low, high = np.maximum(low, box[0]), np.minimum(high, box[1])
    low = np.floor(low / resolution) * resolution
    columns, rows = np.ceil((high - low) / resolution).astype(np.int64).tolist()

    def touched_among(scans: list[int]) -> Callable[[int], NDArray[np.float64]]:
        return lambda k: (touched_by(rays[scans[k]], map_from_laser[scans[k]]) - low) / resolution

    seen, drawn = tiles_touched((bounds - low) / resolution), tiles_in(slice(0, rows), slice(0, columns))
    evidence = Evidence(config, len(seen.intersection(drawn)))
    for drive in np.unique(drives):
        scans = np.flatnonzero(drives == drive).tolist()
        evidence.settle()
        evidence.count(
            touched_among(scans),
            [rays[scan].returns for scan in scans],
            within=(slice(0, rows), slice(0, columns)),
        )
    return TiledGrid(evidence.cells(), rows, columns, resolution, np.array([low[0], low[1], 0.0]))


def bounds_of(rays: Sequence[Rays], map_from_laser: Pose) -> NDArray[np.float64]:
    """(K, 2, 2) metres in the map: lower left and upper right of what each of rays (K) from poses (K, 3)
    touches."""
    bounds = np.empty((len(rays), 2, 2))
    for k, (pose, ray) in enumerate(zip(map_from_laser, rays, strict=True)):
        points = touched_by(ray, pose)
        bounds[k] = points.min(axis=0), points.max(axis=0)
    return bounds


def seen_box(bounds: NDArray[np.float64], margin: float) -> Box:
    """Bounding box of bounds (K, 2, 2), K at least 1, with a margin in metres."""
    return bounds[:, 0].min(axis=0) - margin, bounds[:, 1].max(axis=0) + margin


def touched_by(rays: Rays, map_from_laser: Pose) -> NDArray[np.float64]:
    """(N + 1, 2) metres in the map: ends of rays from a pose (3,), then their start."""
    return np.concatenate([transform_points(map_from_laser, rays.ends), map_from_laser[None, :2]])


def pixels_of(config: RenderingConfig) -> dict[str, Any]:
    """The settings of the image, by their names in `racecar.maps.map_files.save_map`."""
    return {
        "mode": config.mode,
        "occupied_threshold": config.occupied_threshold,
        "free_threshold": config.free_threshold,
    }
