"""Two moments at one place: the scans about both, aligned."""

import math

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops.submap_matching import align_submaps
from racecar.mapping.mending.manual_constraints import SamePlace
from racecar.mapping.mending.moments import keyframe_at, submap_about
from racecar.mapping.mending.refused import RefusedConstraintError
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, inverse
from racecar.sensors.matching.correlative_search import Window, search

_ANYWHERE = Window(4.0, math.pi)
"""Metres and radians about the first moment in which the second is searched for. Chosen by judgement: people
say so of cars in one corridor, whatever the heading."""
_ABOUT_GIVEN = Window(1.0, math.radians(15.0))
"""The same about a pose that was given. Chosen by judgement: as exactly as people drag a scan."""
_OF_GIVEN = np.diag([0.3**-2, 0.3**-2, math.radians(5.0) ** -2])
"""Information of a pose that was given, which decides along bare walls. Chosen by judgement: a third of that
window."""
_MOST_OPEN = 0.5
"""Metres, standard deviation along bare walls from which the scans alone do not say where both moments lie.
Chosen by judgement: what a good map may err."""
_RADIUS = 25.0
"""Metres of the first moment's surroundings that are searched, because scans of the second are sampled within
15 m."""
_POINTS = 500
"""Points to search with at most, because of the time it takes."""
_LEAST_SCORE = 0.15
"""Least mean likelihood of what fits. Chosen by judgement: less than loop closure asks for, because people
know the place."""
_LEAST_AGREEMENT = 0.7
"""Least share of judged points that lie on the other's surfaces. Measured: race drives of one hall reach 0.62
to 0.79 at right places and between neighbouring scans alike."""
_LEAST_COVERAGE = 0.1
"""Least share of points that the other could judge, because less is no evidence."""


def tie_of_same_place(constraint: SamePlace, session: Session, poses: Pose) -> Constraint:
    """The constraint between the keyframes of both moments, with keyframes at ``poses`` (K, 3).

    Raises RefusedConstraintError when the scans contradict it.
    """
    store = session.keyframes
    first, second = (keyframe_at(moment, session) for moment in (constraint.first, constraint.second))
    if first == second:
        raise RefusedConstraintError("Both moments are of one keyframe: it is at one place already.")
    fixed, moving = (submap_about(keyframe, session, poses) for keyframe in (first, second))
    first_from_base, second_from_base = session.keyframe_from_base[[first, second]]
    if constraint.first_from_second is None:
        turned = between(poses[first], poses[second])[2]
        guess, window = np.array([0.0, 0.0, turned]), _ANYWHERE
    else:
        given = compose(first_from_base, np.array(constraint.first_from_second))
        guess, window = compose(given, inverse(second_from_base)), _ABOUT_GIVEN
    points = moving.sample(store, poses, _POINTS)
    found = (
        None
        if points is None
        else search(fixed.pyramid(store, poses, _RADIUS), points, guess, window, _LEAST_SCORE)
    )
    if found is None:
        raise RefusedConstraintError(
            f"The scans about {_times(constraint)} fit nowhere on each other within {window.reach:.0f} m: it "
            "is not one place, or they see too little of it."
        )
    aligned = align_submaps(fixed, moving, poses, found.pose, store)
    if are_apart(found.pose, aligned.fixed_from_moving, (window.reach, _ABOUT_GIVEN.turn)):
        raise RefusedConstraintError(
            f"The scans about {_times(constraint)} do not stay where they were laid on each other: name "
            "moments at which both see the same walls."
        )
    seen = aligned.seen(store)
    if seen.agreement < _LEAST_AGREEMENT:
        raise RefusedConstraintError(
            f"The scans contradict it: about {_times(constraint)} they look through "
            f"{1.0 - seen.agreement:.0%} of each other's walls where they fit best."
        )
    if seen.coverage < _LEAST_COVERAGE:
        raise RefusedConstraintError(
            f"About {_times(constraint)} the scans share {seen.coverage:.0%} of what they see, too little to "
            "tell: name moments at which both see the same walls."
        )
    information = aligned.information
    if constraint.first_from_second is not None:
        information = information + _OF_GIVEN
    elif np.sqrt(np.linalg.eigvalsh(np.linalg.inv(information)[:2, :2])[1]) > _MOST_OPEN:
        raise RefusedConstraintError(
            f"The walls about {_times(constraint)} do not show where along them both moments lie: give the "
            "pose between them, or name moments beside something that stands out."
        )
    return Constraint(first, second, aligned.fixed_from_moving, information, "manual")


def _times(constraint: SamePlace) -> str:
    return f"{constraint.first.seconds:.1f} s and {constraint.second.seconds:.1f} s"
