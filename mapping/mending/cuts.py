"""Constraints that people know to be wrong, taken out of the graph."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.keyframes.first_pass import are_between_passes
from racecar.mapping.mending.manual_constraints import Distrust, Moment, NotSamePlace
from racecar.mapping.mending.moments import keyframe_at, keyframes_between
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose, between

_ONE_STRETCH = 6.0
"""Metres of path, on both passes, within which ties are of one mistake: as long as a submap, because loop
closures are found submap by submap."""
_LOOSE = np.eye(3) / 0.5**2
"""Information per square metre and radian of a step that nothing trusted measured. Chosen by judgement: about
the spacing of keyframes."""


def mistaken_ties(
    constraint: NotSamePlace, constraints: ConstraintList, session: Session, poses: Pose
) -> NDArray[np.bool_]:
    """(C,) constraints between the passes near both moments, and those adjacent to them along both. Raises
    RefusedConstraintError when there are none."""
    named = [keyframe_at(moment, session) for moment in (constraint.first, constraint.second)]
    path = lengths_along(poses[:, :2])
    ties = np.flatnonzero(are_between_passes(constraints, session.times.numbers))
    at = np.concatenate([np.sort(path[constraints.ends[ties]], axis=1), np.sort(path[named])[None]])
    pairs = cKDTree(at).query_pairs(_ONE_STRETCH, p=np.inf, output_type="ndarray")
    linked = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(at), len(at)))
    of = connected_components(linked, directed=False)[1]
    mistaken = np.zeros(len(constraints), dtype=np.bool_)
    mistaken[ties[of[:-1] == of[-1]]] = True
    if not mistaken.any():
        raise _nothing_is_cut(constraint, constraints.ends[ties], at, session)
    return mistaken


def _nothing_is_cut(
    constraint: NotSamePlace, ends: NDArray[np.int32], at: NDArray[np.float64], session: Session
) -> RefusedConstraintError:
    """Names the nearest of the ties between keyframes (N, 2), which lie ``at`` metres of path (N + 1, 2), the
    named moments last."""
    named = f"{constraint.first.seconds:.1f} s to {constraint.second.seconds:.1f} s"
    why = f"Nothing ties {named}: the map does not take them for one place."
    if len(ends) == 0:
        return RefusedConstraintError(f"{why} Wheels or scans in between may be wrong (distrust).")
    times = session.times
    nearest = np.sort(ends[np.argmin(np.abs(at[:-1] - at[-1]).sum(axis=1))])
    first, second = (Moment(float(times.seconds[k]), int(times.numbers[k])) for k in nearest)
    return RefusedConstraintError(
        f"{why} The nearest tie is of {first.seconds:.1f} s and {second.seconds:.1f} s: name these if they "
        "are two places.",
        (first, second),
    )


def without_distrusted(
    constraint: Distrust, constraints: ConstraintList, session: Session, poses: Pose
) -> list[Constraint]:
    """The constraints without what wheels or scans said in a stretch; steps without any
    measurement left get a loose one, from the map. Raises RefusedConstraintError without such a stretch."""
    begin, end = constraint.begin, constraint.end
    if begin.recording != end.recording or end.seconds < begin.seconds:
        raise RefusedConstraintError("What is distrusted begins and ends in one recording, in this order.")
    are_in = keyframes_between(begin, end, session)
    of_source = constraints.are("odometry")
    if constraint.source == "scans":
        of_source = constraints.are("scan_matching") | constraints.are("loop_closure")
    left = list(constraints.chosen(np.flatnonzero(~(of_source & are_in[constraints.ends].any(axis=1)))))
    numbers, spanned = session.times.numbers, np.zeros(len(are_in), dtype=np.int64)
    for each in left:
        if each.kind != "loop_closure":
            spanned[min(each.from_keyframe, each.to_keyframe) + 1 : each.to_keyframe + 1] += 1
    touched = np.flatnonzero((are_in[1:] | are_in[:-1]) & (spanned[1:] == 0) & (np.diff(numbers) == 0))
    steps = between(poses[touched], poses[touched + 1])
    return left + [
        Constraint(k, k + 1, step, _LOOSE, "odometry")
        for k, step in zip(touched.tolist(), steps, strict=True)
    ]
