"""Manual constraints in a few words, for a list."""

import math

from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Here,
    ManualConstraint,
    Moment,
    NotSamePlace,
    RightAngle,
    SamePlace,
    Straight,
)


def described(constraint: ManualConstraint) -> str:
    """What a constraint states."""
    match constraint:
        case SamePlace(first, second):
            return f"same place: {when(first)} and {when(second)}"
        case NotSamePlace(first, second):
            return f"not the same place: {when(first)} and {when(second)}"
        case Distance(_, metres):
            return f"distance: {metres:g} m"
        case Straight(points):
            return f"straight wall of {math.dist(*points):.1f} m"
        case RightAngle():
            return "right angle between walls"
        case Here(moment, (x, y)):
            return f"at {when(moment)}: x {x:.2f} m, y {y:.2f} m"
        case Distrust(source, begin, end):
            return f"{source} distrusted: {when(begin)} to {when(end)}"


def when(moment: Moment) -> str:
    """A moment, with its drive if there are several."""
    drive = "" if moment.recording is None else f"drive {moment.recording + 1}, "
    return f"{drive}{moment.seconds:.1f} s"
