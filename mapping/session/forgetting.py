"""Forget keyframes that later drives replace, so that a session grows with places and not with drives, and
shows places as they are now.

A keyframe is removed when later drives passed it: their scans are newer, and as good. Its constraints pass on
to the remaining keyframes. (Keeping the map of a changing place small by the information in scans:
Kretzschmar and Stachniss, IJRR 2012; dropping the scans of what has changed: Walcott-Bryant et al., "Dynamic
pose graph SLAM", IROS 2012.)
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.contraction import contracted
from racecar.mapping.grid.rendering import Rays, bounds_of, touched_by
from racecar.mapping.keyframes.first_pass import ALIKE_TURN, NEAR
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, wrap_angle

_CELL = 0.25
"""Metres of a cell, since narrower spots are irrelevant to a car."""
_OUTDATED_AFTER = 2
"""Number of later drives near a keyframe after which it is forgotten. Chosen by judgement: one could be
misled by people, two show what stays."""


def forget_outdated(session: Session) -> Session:
    """The session without keyframes that enough later drives passed, except those that alone show something:
    behind a door that is now closed, or beyond the range of a later laser."""
    remains = _drives_later(session) < _OUTDATED_AFTER
    if remains.all():
        return session
    remains = showing_more(session.rays, session.map_from_keyframe, remains)
    constraints = contracted(session.constraints, session.map_from_keyframe, remains)
    left = replace(session.only(remains), constraints=constraints)
    if session.measured is None or left.measured is None:
        return left
    known = session.measured
    measured = contracted(known.constraints, known.map_from_keyframe, remains)
    return replace(left, measured=replace(left.measured, constraints=measured))


def _drives_later(session: Session) -> NDArray[np.int64]:
    """(K,) number of later drives that passed each keyframe and saw something there."""
    poses, drives = session.map_from_keyframe, session.times.drives.astype(np.int64)
    pairs = cKDTree(poses[:, :2]).query_pairs(NEAR, output_type="ndarray")
    pairs = np.take_along_axis(pairs, np.argsort(drives[pairs], axis=1), axis=1)
    earlier, later = pairs.T
    face_alike = np.abs(wrap_angle(poses[earlier, 2] - poses[later, 2])) < ALIKE_TURN
    shows = (drives[later] > drives[earlier]) & face_alike & session.keyframes.is_kept[later]
    passed = np.unique(np.column_stack([earlier[shows], drives[later[shows]]]), axis=0)
    return np.bincount(passed[:, 0], minlength=len(poses))


def showing_more(rays: Sequence[Rays], map_from_laser: Pose, is_kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(K,) kept keyframes, with rays (K) at poses (K, 3), plus those of the others, from last to first, that
    show something none of these does."""
    bounds = bounds_of(rays, map_from_laser)
    low = bounds[:, 0].min(axis=0) - _CELL
    columns, rows = (np.ceil((bounds[:, 1].max(axis=0) - low) / _CELL).astype(np.int64) + 1).tolist()
    seen = np.zeros((rows, columns), dtype=np.bool_)

    def newly_seen(k: int) -> int:
        return int(_look((touched_by(rays[k], map_from_laser[k]) - low) / _CELL, seen))

    chosen = is_kept.copy()
    for k in np.flatnonzero(is_kept).tolist():
        newly_seen(k)
    for k in np.flatnonzero(~is_kept)[::-1].tolist():
        chosen[k] = rays[k].are_kept and newly_seen(k) > 0
    return chosen


@njit(cache=True, nogil=True)
def _look(touched: NDArray[np.float64], seen: NDArray[np.bool_]) -> int:
    """Number of cells (rows, columns) that a scan touches and that were not ``seen``; marks them as seen.

    ``touched`` (N + 1, 2), fractional column and row, are the ends of its rays, then their start. Rays are
    sampled every half cell at most, so that few cells cut at a corner are missed.
    """
    column, row = touched[-1]
    unseen = 0
    for i in range(len(touched)):
        dx, dy = touched[i, 0] - column, touched[i, 1] - row
        steps = int(2.0 * max(abs(dx), abs(dy))) + 1
        for step in range(steps + 1):
            share = step / steps
            r, c = int(row + share * dy), int(column + share * dx)
            if not seen[r, c]:
                seen[r, c] = True
                unseen += 1
    return unseen
