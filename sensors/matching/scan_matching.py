"""Scan matching: align one group of scans with another."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_matching_kernels import MatchChoices, PairedRows, match_groups
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.threads import thread_count

_INITIAL_DISTANCE = 0.5
"""Default of the initial correspondence distance in metres. Measured in a prototype on aces, fr079 and intel,
as is the next."""
_KERNEL_WIDTH = 0.04
"""Residual in metres at which a point's weight is a quarter (Geman and McClure, 1987), likewise."""
_NO_PRIOR = np.zeros((3, 3))
"""No prior information, by definition."""
_WORKERS = 2
"""Threads at most, since the computers of small cars have few cores and other work to do."""
_WORTH_THREADS = 64
"""Number of groups from which threads are used, since starting them takes as long as matching a few. Chosen
by judgement."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Results for G groups."""

    poses: Pose
    """(G, 3) fixed_from_moving."""
    hessians: NDArray[np.float64]
    """(G, 3, 3) in the tangent frame of the moving group, for residuals of unit variance."""
    overlap: NDArray[np.float64]
    """(G,) share of points that found a correspondence."""
    residual: NDArray[np.float64]
    """(G,) weighted root mean square point-to-line distance, metres."""
    weight: NDArray[np.float64]
    """(G,) sum of robust weights."""

    def with_more(self, others: "Matches") -> "Matches":
        """Concatenate these groups and others."""
        return Matches(
            *(np.concatenate([getattr(self, each.name), getattr(others, each.name)]) for each in fields(self))
        )


@dataclass(frozen=True, eq=False)
class Pairings:
    """Pairs of scans with their initial poses; rows ``starts[g]`` to ``starts[g + 1]`` belong to group g."""

    starts: NDArray[np.int64]
    """(G + 1,)"""
    pairs: NDArray[np.int64]
    """(P, 2) fixed scan, moving scan."""
    fixed_poses: Pose
    """(P, 3) pose of the fixed scan in the fixed frame."""
    moving_poses: Pose
    """(P, 3) pose of the moving scan in its group's frame."""


def one_to_one(pairs: NDArray[np.int64]) -> Pairings:
    """One group per pair (P, 2), to find the pose of the moving scan in the frame of the fixed one."""
    count = len(pairs)
    return Pairings(np.arange(count + 1), pairs, np.zeros((count, 3)), np.zeros((count, 3)))


def match(
    guesses: Pose,
    pairings: Pairings,
    fixed: ScanStore,
    moving: ScanStore,
    *,
    initial_distance: float = _INITIAL_DISTANCE,
    kernel_width: float = _KERNEL_WIDTH,
    prior_information: NDArray[np.float64] = _NO_PRIOR,
    both_ways: bool = True,
) -> Matches:
    """Match G groups from initial guesses (G, 3).

    Points of the moving scans are aligned with lines of the fixed ones and, ``both_ways``, vice versa. The
    search for correspondences begins at ``initial_distance`` metres; a residual of ``kernel_width`` metres is
    weighted a quarter. ``prior_information`` (3, 3), in the units of the Hessian, is that of the guesses.
    """
    choices = MatchChoices(initial_distance, kernel_width, both_ways)
    groups = len(guesses)
    poses = np.array(guesses, dtype=np.float64)
    hessians, qualities = np.zeros((groups, 3, 3)), np.zeros((groups, 3))
    scans_fixed, scans_moving = pairings.pairs.T
    rows = np.column_stack([fixed.row_of[scans_fixed], moving.row_of[scans_moving]]).astype(np.int64)
    pairs = PairedRows(rows, pairings.fixed_poses, pairings.moving_poses)

    def work(part: NDArray[np.int64]) -> None:
        if len(part) == 0:
            return
        a, b = part[0], part[-1] + 1
        match_groups(
            poses[a:b],
            pairings.starts[a : b + 1],
            pairs,
            prior_information,
            fixed.packed(),
            moving.packed(),
            choices,
            hessians[a:b],
            qualities[a:b],
        )

    if groups < _WORTH_THREADS:
        work(np.arange(groups))
    else:
        with ThreadPoolExecutor(thread_count(_WORKERS)) as pool:
            list(pool.map(work, np.array_split(np.arange(groups), 4 * _WORKERS)))
    return Matches(poses, hessians, qualities[:, 0], qualities[:, 1], qualities[:, 2])
