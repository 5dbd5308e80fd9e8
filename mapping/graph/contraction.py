"""Contract the pose graph: remove keyframes while preserving what their constraints say about the others.

A removed keyframe is merged into the neighbour with the most certain link, which inherits its other links
with added covariance (Eade, Fong and Munich, "Monocular graph SLAM with complexity reduction", IROS 2010).
Relative poses are taken from the solution, which therefore stays the same, as in Carlevaris-Bianco and
Eustice, "Long-term simultaneous localization and mapping with generic linear constraint node removal", IROS
2013.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, adjoint, between, inverse

_Tie = TypeVar("_Tie")
_Ties = dict[int, dict[int, NDArray[np.float64]]]
"""By both keyframes, in either order: covariances (3, 3) as twists in the map, where those of chained links
add up (Barfoot and Furgale, "Associating uncertainty with three-dimensional poses", 2014)."""


def contracted(constraints: ConstraintList, poses: Pose, is_left: NDArray[np.bool_]) -> ConstraintList:
    """Constraints between the remaining keyframes (K,), renumbered, at solved ``poses`` (K, 3): their own and
    those inherited from removed ones."""
    left, number = list(constraints.among(is_left)), (np.cumsum(is_left) - 1).tolist()
    tied = {(min(pair), max(pair)) for pair in constraints.ends.tolist()}
    ties = _ties(constraints, poses)
    inherited = ties_passed_on(ties, is_left, lambda _, __, tie: np.linalg.det(tie), np.add)
    for first, second, tie in inherited:
        if (first, second) not in tied:
            map_from_second = adjoint(poses[second])
            information = map_from_second.T @ np.linalg.inv(tie) @ map_from_second
            step = between(poses[first], poses[second])
            left.append(Constraint(number[first], number[second], step, information, "scan_matching"))
    return ConstraintList(sorted(left, key=lambda each: each.to_keyframe))


def _ties(constraints: ConstraintList, poses: Pose) -> _Ties:
    """The most certain constraint of each pair."""
    arrays = constraints.to_arrays()
    second_from_map = adjoint(inverse(poses[arrays["keyframes"][:, 1]]))
    in_map = np.swapaxes(second_from_map, 1, 2) @ arrays["information"] @ second_from_map
    covariances = np.linalg.inv(in_map)
    ties: _Ties = defaultdict(dict)
    for k in np.argsort(np.linalg.det(covariances))[::-1].tolist():
        first, second = arrays["keyframes"][k].tolist()
        ties[first][second] = ties[second][first] = covariances[k]
    return ties


def ties_passed_on(
    ties: dict[int, dict[int, _Tie]],
    is_left: NDArray[np.bool_],
    looseness: Callable[[int, int, _Tie], Any],
    in_a_row: Callable[[_Tie, _Tie], _Tie],
) -> Iterator[tuple[int, int, _Tie]]:
    """Yield the links between the remaining nodes (N,), in ascending pairs, after removing all others in
    turn.

    A removed node passes its links to a neighbour, if possible a remaining one: that of least ``uncertainty``
    of both nodes and their link. Links that it has are kept. Consumes ``links``.
    """
    for going in np.flatnonzero(~is_left).tolist():
        of_going = ties.pop(going, {})
        for other in of_going:
            del ties[other][going]
        if not of_going:
            continue
        heir = min(of_going, key=lambda k: (not is_left[k], looseness(going, k, of_going[k])))
        for other, tie in of_going.items():
            if other != heir and other not in ties[heir]:
                ties[heir][other] = ties[other][heir] = in_a_row(of_going[heir], tie)
    for first, of_first in ties.items():
        for second, tie in of_first.items():
            if first < second:
                yield first, second, tie
