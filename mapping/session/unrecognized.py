"""Why a drive was not recognized on an earlier map, and how far that got, for people."""

import numpy as np

from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.session.place_recognition import Recognition
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose


class NotRecognizedError(UserError):
    """A drive was not recognized on an earlier map.

    Its sentence has no full stop, so that whoever knows what would help can add that.
    """


def not_recognized(recognition: Recognition, loops: LoopCloser) -> NotRecognizedError:
    """The error, which says how far the recognition got."""
    return NotRecognizedError(
        f"The drive was not recognized on the earlier map: {_how_far(recognition, loops)}"
    )


def _how_far(recognition: Recognition, loops: LoopCloser) -> str:
    path, poses = loops.history.graph.path, recognition.poses
    metres = path[-1] - path[recognition.first]
    if recognition.is_too_short:
        return f"its {metres:.0f} m are too few to be sure"
    if recognition.last_known is None or recognition.last_place is None:
        if recognition.is_given:
            return "its scans do not fit where it was said to begin"
        return f"on all of its {metres:.0f} m no place there fits its scans, or several do"
    if recognition.rivals:
        found, rival = recognition.found[-1], recognition.rivals[-1]
        first, second = (compose(poses[h.fixed.middle], h.fixed_from_moving) for h in (found, rival))
        return f"it fits at {_in_words(first)} as well as at {_in_words(second)}"
    known = path[recognition.last_known] - path[recognition.first]
    at = f"{known:.0f} m into it the car seemed to be at {_in_words(recognition.last_place)}"
    if recognition.found:
        return f"{at}, but too few of its {metres:.0f} m fit the walls there"
    return f"{at}, but its scans contradict the walls there"


def _in_words(pose: Pose) -> str:
    x, y, yaw = np.round(pose, 1) + 0.0  # no minus before a nought
    return f"x {x:.1f} m, y {y:.1f} m, yaw {yaw:.1f}"
