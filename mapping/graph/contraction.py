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

from racecar.mapping.graph.constraint import Constraint, ConstraintList, in_order
from racecar.maps.geometry.se2 import Pose, adjoint, between, inverse

_Link = TypeVar("_Link")
_Links = dict[int, dict[int, NDArray[np.float64]]]
"""By both keyframes, in either order: covariances (3, 3) as twists in the map, where those of chained links
add up (Barfoot and Furgale, "Associating uncertainty with three-dimensional poses", 2014)."""


def contracted(constraints: ConstraintList, poses: Pose, remains: NDArray[np.bool_]) -> ConstraintList:
    """Constraints between the remaining keyframes (K,), renumbered, at solved ``poses`` (K, 3): their own and
    those inherited from removed ones."""
    left, number = list(constraints.among(remains)), (np.cumsum(remains) - 1).tolist()
    connected = {(min(pair), max(pair)) for pair in constraints.ends.tolist()}
    links = _links_of(constraints, poses)
    inherited = inherited_links(links, remains, lambda _, __, link: np.linalg.det(link), np.add)
    for first, second, link in inherited:
        if (first, second) not in connected:
            map_from_second = adjoint(poses[second])
            information = map_from_second.T @ np.linalg.inv(link) @ map_from_second
            step = between(poses[first], poses[second])
            left.append(Constraint(number[first], number[second], step, information, "scan_matching"))
    return ConstraintList(in_order(left))


def _links_of(constraints: ConstraintList, poses: Pose) -> _Links:
    """The most certain constraint of each pair."""
    arrays = constraints.to_arrays()
    second_from_map = adjoint(inverse(poses[arrays["keyframes"][:, 1]]))
    in_map = np.swapaxes(second_from_map, 1, 2) @ arrays["information"] @ second_from_map
    covariances = np.linalg.inv(in_map)
    links: _Links = defaultdict(dict)
    for k in np.argsort(np.linalg.det(covariances))[::-1].tolist():
        first, second = arrays["keyframes"][k].tolist()
        links[first][second] = links[second][first] = covariances[k]
    return links


def inherited_links(
    links: dict[int, dict[int, _Link]],
    remains: NDArray[np.bool_],
    uncertainty: Callable[[int, int, _Link], Any],
    chained: Callable[[_Link, _Link], _Link],
) -> Iterator[tuple[int, int, _Link]]:
    """Yield the links between the remaining nodes (N,), in ascending pairs, after removing all others in
    turn.

    A removed node passes its links to a neighbour, if possible a remaining one: that of least ``uncertainty``
    of both nodes and their link. Links that it has are kept. Consumes ``links``.
    """
    for going in np.flatnonzero(~remains).tolist():
        of_going = links.pop(going, {})
        for other in of_going:
            del links[other][going]
        if not of_going:
            continue
        heir = min(of_going, key=lambda k: (not remains[k], uncertainty(going, k, of_going[k])))
        for other, link in of_going.items():
            if other != heir and other not in links[heir]:
                links[heir][other] = links[other][heir] = chained(of_going[heir], link)
    for first, of_first in links.items():
        for second, link in of_first.items():
            if first < second:
                yield first, second, link
