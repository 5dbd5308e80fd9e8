"""Nodes of a graph go, and what they were tied to stays tied."""

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_Tie = TypeVar("_Tie")


def ties_passed_on(
    ties: dict[int, dict[int, _Tie]],
    is_left: NDArray[np.bool_],
    looseness: Callable[[int, int, _Tie], Any],
    in_a_row: Callable[[_Tie, _Tie], _Tie],
) -> Iterator[tuple[int, int, _Tie]]:
    """The ties between the nodes that are left (N,), by rising pairs, once all others have gone in turn.

    Each passes on its ties to the one, rather of those that are left, to which it is tied least loosely: by
    ``looseness`` of a node, another and their tie. Where that one has a tie already, it is kept. ``ties``, by
    both nodes, either way, are used up.
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
