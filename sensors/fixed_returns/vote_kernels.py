"""Whether each return of a scan is of something in the world or moves along, by another scan."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

WORLD, OPEN, ALONG = -1, 0, 1
"""Votes, of such signs so that they can be added up."""
_WIDEST = 0.35
"""Radians to each side in which a thing is looked for, since right before the laser it has any bearing."""


class Limits(NamedTuple):
    """What two returns of one thing have in common."""

    fixed: float = 0.1
    """Metres by which ranges at one bearing may differ if they are of one thing that moves along; by
    judgement: the floor's unevenness, seen at a grazing angle."""
    tolerance: float = 0.15
    """Metres within which two returns are of one thing in the world; by judgement: what wheels err over the
    distance between two scans, and the skew of a sweep."""
    through: float = 0.25
    """Metres beyond a return from which another scan looked through its place; by judgement: more than the
    tolerance."""
    dropouts: int = 2
    """Beams to each side that stand in for one that came back empty; by judgement: of some lasers half do."""


class Apart(NamedTuple):
    """Where two scans were that show what moves along."""

    reach: float = 5.0
    """Seconds within which they are compared; by judgement: in these a slow robot drives the distance, and
    wheels drift less than the tolerance."""
    distance: float = 0.5
    """Metres between them; by judgement: several times the tolerance."""
    angle: float = 0.35
    """Radians that may do instead. Measured: 20° on the spot show who carries a robot, and nobody in other
    recordings."""
    max_angle: float = 1.0
    """Radians up to which they are compared at the distance: what is round and near shows by the distance
    only. By judgement: narrow fields of view still overlap."""


LIMITS, APART = Limits(), Apart()


@njit(cache=True, nogil=True)
def votes(
    ranges: NDArray[np.float64],
    bearings: NDArray[np.float64],
    other_ranges: NDArray[np.float64],
    other_bearings: NDArray[np.float64],
    other_from_here: NDArray[np.float64],
    limits: Limits,
) -> NDArray[np.int8]:
    """(N,) of each return of a scan with ranges and bearings (N,), by another one (M,) whose laser sees this
    one at ``other_from_here`` (3,).

    A return that the other scan has at the same place, but not at the same bearing and range, is of the
    world. One that it has at the same bearing and range, while either scan looks through the place where the
    other one has it, moves along. All else is open: along a wall both hold.
    """
    found = np.zeros(len(ranges), dtype=np.int8)
    x, y, turn = other_from_here
    cos, sin = np.cos(turn), np.sin(turn)
    for beam in range(len(ranges)):
        range_, bearing = ranges[beam], bearings[beam]
        if not np.isfinite(range_):
            continue
        fixed, is_known = np.nan, False
        middle = np.searchsorted(other_bearings, bearing - 1e-6)
        for k in range(middle - limits.dropouts, middle + limits.dropouts + 1):
            if 0 <= k < len(other_ranges) and np.isfinite(other_ranges[k]):
                is_known = True
                if abs(other_ranges[k] - range_) < limits.fixed:
                    fixed = other_ranges[k]
        along, aside = range_ * np.cos(bearing), range_ * np.sin(bearing)
        in_other = x + cos * along - sin * aside, y + sin * along + cos * aside
        there = _look(other_ranges, other_bearings, in_other, limits)
        if there == WORLD:
            if is_known and np.isnan(fixed):
                found[beam] = WORLD
            continue
        if np.isnan(fixed):
            continue
        along, aside = fixed * np.cos(bearing) - x, fixed * np.sin(bearing) - y
        here = _look(ranges, bearings, (cos * along + sin * aside, cos * aside - sin * along), limits)
        if here != WORLD and (here == ALONG or there == ALONG):
            found[beam] = ALONG
    return found


@njit(cache=True, nogil=True)
def _look(
    ranges: NDArray[np.float64], bearings: NDArray[np.float64], point: tuple[float, float], limits: Limits
) -> int:
    """At a point, metres in the laser's frame: does a scan have a return there (WORLD), do all its returns
    about that bearing that nothing hides lie beyond (ALONG), or neither?"""
    distance, bearing = np.hypot(point[0], point[1]), np.arctan2(point[1], point[0])
    if bearing < bearings[0]:
        bearing += 2.0 * np.pi
    elif bearing > bearings[-1]:
        bearing -= 2.0 * np.pi
    half = min(limits.tolerance / max(distance, 1e-3), _WIDEST)
    first = max(np.searchsorted(bearings, bearing - half) - 1, 0)
    last = min(np.searchsorted(bearings, bearing + half) + 1, len(ranges))
    seen, beyond = 0, 0
    if bearing < bearings[0] - half or bearing > bearings[-1] + half:
        return OPEN
    for k in range(first, last):
        if np.isfinite(ranges[k]):
            aside = bearings[k] - bearing
            if (ranges[k] - distance) ** 2 + ranges[k] * distance * aside**2 < limits.tolerance**2:
                return WORLD
            if ranges[k] > distance - limits.through:  # what is nearer hides the place, and says nothing
                seen += 1
                beyond += ranges[k] > distance + limits.through
    return ALONG if 0 < seen == beyond else OPEN


@njit(cache=True, nogil=True)
def partners(
    poses: NDArray[np.float64],
    segments: NDArray[np.int64],
    seconds: NDArray[np.float64],
    apart: Apart,
) -> NDArray[np.int64]:
    """(N, 2) of scans at poses (N, 3) and times (N,): the nearest one before each, and after it, that is the
    distance away; where the laser turns by the largest angle before, or comes not that far, the nearest one
    that is the angle away. It is -1 where there is none of its segment within reach (seconds)."""
    found = np.full((len(poses), 2), -1, dtype=np.int64)
    for scan in range(len(poses)):
        for side in range(2):
            other = scan
            while True:
                other += 2 * side - 1
                if other < 0 or other >= len(poses) or segments[other] != segments[scan]:
                    break
                turn = abs((poses[other, 2] - poses[scan, 2] + np.pi) % (2.0 * np.pi) - np.pi)
                if abs(seconds[other] - seconds[scan]) > apart.reach:
                    break
                distance = np.hypot(poses[other, 0] - poses[scan, 0], poses[other, 1] - poses[scan, 1])
                is_far = distance >= apart.distance
                if is_far or (turn >= apart.angle and found[scan, side] < 0):
                    found[scan, side] = other
                if is_far or turn >= apart.max_angle:
                    break
    return found
