"""The map that a drive carries on, and who finds the drive there."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeAlias

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose

FindPlaces: TypeAlias = Callable[[Session], Iterable[Pose | None]]
"""Where (3,) on the earlier map each keyframe of a session may lie, in turn; None where that is not known."""


@dataclass(frozen=True, eq=False)
class EarlierMap:
    """What earlier drives left."""

    session: Session
    find_places: FindPlaces
    """Nothing that it finds is believed before it is verified."""
    is_start_given: bool = False
    """Whether somebody knows where the drive begins, so that other places may look alike."""
