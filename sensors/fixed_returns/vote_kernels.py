"""Vote whether each return of a scan is part of the world or fixed to the robot, given another scan."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

WORLD, UNDECIDED, FIXED = -1, 0, 1
"""Votes, signed so that they can be summed."""
_WIDEST = 0.35
"""Radians to each side of the search window, since an object right before the laser may have any bearing."""


class Limits(NamedTuple):
    """Tolerances for two returns of one object."""

    fixed: float = 0.1
    """Metres by which ranges of a fixed object may differ at one bearing. Chosen by judgement: unevenness of
    the floor at a grazing angle."""
    tolerance: float = 0.15
    """Metres within which two returns belong to one object of the world. Chosen by judgement: wheel error
    between two scans plus the skew of a sweep."""
    through: float = 0.25
    """Metres beyond a return from which another scan sees through its place. Chosen by judgement: more than
    the tolerance."""
    dropouts: int = 2
    """Beams to each side that may stand in for a miss. Chosen by judgement: some lasers miss with half."""


class Apart(NamedTuple):
    """How far apart two scans must be to show fixed returns."""

    reach: float = 5.0
    """Seconds between two compared scans at most. Chosen by judgement: a slow robot covers the distance, and
    wheels drift less than the tolerance."""
    distance: float = 0.5
    """Metres between them. Chosen by judgement: several times the tolerance."""
    angle: float = 0.35
    """Radians between them as an alternative. Measured: 20° on the spot reveal a robot's carrier, and nobody
    in other recordings."""
    max_angle: float = 1.0
    """Radians up to which scans are compared at the distance, since round objects nearby show only in
    distance. Chosen by judgement: narrow fields of view still overlap."""


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
    """(N,) votes on the returns of a scan with ranges and bearings (N,) by another scan (M,), whose laser
    sees this one at ``other_from_here`` (3,).

    A return is part of the world if the other scan has it at the same place but not at the same bearing and
    range. It is fixed if the other scan has it at the same bearing and range, while either scan sees through
    the place where the other has it. Otherwise it is undecided: along a wall both hold.
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
        if here != WORLD and (here == FIXED or there == FIXED):
            found[beam] = FIXED
    return found


@njit(cache=True, nogil=True)
def _look(
    ranges: NDArray[np.float64], bearings: NDArray[np.float64], point: tuple[float, float], limits: Limits
) -> int:
    """What a scan sees at a point in the laser's frame, in metres: a return (WORLD), only returns beyond it
    on all unobstructed beams (FIXED), or neither (UNDECIDED)."""
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
        return UNDECIDED
    for k in range(first, last):
        if np.isfinite(ranges[k]):
            aside = bearings[k] - bearing
            if (ranges[k] - distance) ** 2 + ranges[k] * distance * aside**2 < limits.tolerance**2:
                return WORLD
            if ranges[k] > distance - limits.through:  # nearer returns occlude the place
                seen += 1
                beyond += ranges[k] > distance + limits.through
    return FIXED if 0 < seen == beyond else UNDECIDED


@njit(cache=True, nogil=True)
def partners(
    poses: NDArray[np.float64],
    segments: NDArray[np.int64],
    seconds: NDArray[np.float64],
    apart: Apart,
) -> NDArray[np.int64]:
    """(N, 2) partners of scans at poses (N, 3) and times (N,): the nearest earlier and later ones at the
    required distance. Where the laser first turns by more than the largest angle, or stays too close, the
    nearest at the required angle. -1 where no scan of its segment qualifies within ``reach`` (seconds)."""
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
