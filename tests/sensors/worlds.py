"""Places made of straight walls, and what a laser sees in them, exact to rounding."""

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose, chained, compose
from racecar.sensors.matching.scan_store import ScanStore, prepare_scan
from racecar.sensors.scan import Scan

BEARINGS = np.radians(np.arange(-135.0, 135.0, 0.75))
MAX_RANGE = 30.0


def outline(*corners: tuple[float, float]) -> np.ndarray:
    """(S, 2, 2) the walls of a closed polygon."""
    ends = np.array(corners, dtype=float)
    return np.stack([ends, np.roll(ends, -1, axis=0)], axis=1)


def box(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    """(4, 2, 2)"""
    return outline((x0, y0), (x1, y0), (x1, y1), (x0, y1))


ROOM = np.concatenate(
    [box(-4, -3, 5, 4), box(1.0, -3.0, 1.4, -2.0), box(-2.5, 2.5, -1.0, 3.0), box(3, 1, 3.6, 2)]
)
"""9 x 7 m with a pillar and furniture: no place in it is like another."""

CORRIDOR = np.array([[[-200.0, -1.0], [200.0, -1.0]], [[-200.0, 1.0], [200.0, 1.0]]])
"""2 m wide, without an end."""


def ranges(walls: np.ndarray, pose: Pose, bearings: np.ndarray = BEARINGS) -> np.ndarray:
    """(N,) metres to walls (S, 2, 2) along bearings (N,), inf for a miss, from a laser at ``pose``: (3,), or
    (N, 3) where it moves."""
    at = np.broadcast_to(pose, (len(bearings), 3))
    direction = np.stack([np.cos(at[:, 2] + bearings), np.sin(at[:, 2] + bearings)], axis=1)[:, None]
    start, along = walls[:, 0] - at[:, None, :2], walls[:, 1] - walls[:, 0]

    def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        facing = cross(direction, along)
        distance, share = cross(start, along) / facing, cross(start, direction) / facing
        meets = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
    nearest = np.where(meets, distance, np.inf).min(axis=1)
    return np.where(nearest < MAX_RANGE, nearest, np.inf)


def scan_at(walls: np.ndarray, pose: Pose, stamp: int = 0, base_from_laser: Pose = IDENTITY) -> Scan:
    """All beams at once, from a laser at ``pose`` (3,)."""
    return Scan(stamp, BEARINGS, ranges(walls, pose), np.zeros(len(BEARINGS)), base_from_laser, MAX_RANGE)


def points_at(walls: np.ndarray, pose: Pose) -> np.ndarray:
    """(M, 2) the returns, in the laser frame."""
    return scan_at(walls, pose).points_in_laser()


def path(step: Pose, start: tuple[float, float, float], steps: int) -> Pose:
    """(steps + 1, 3) the same step again and again."""
    return compose(np.array(start), chained(np.tile(step, (steps, 1))))


def store_of(walls: np.ndarray, poses: Pose, sight: float = MAX_RANGE) -> ScanStore:
    """Scans from poses (K, 3), which see so many metres far."""
    store = ScanStore(len(poses))
    for pose in poses:
        points = points_at(walls, pose)
        store.add(prepare_scan(points[np.hypot(points[:, 0], points[:, 1]) < sight]))
    return store
