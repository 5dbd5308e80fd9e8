"""Gaps without scans: what the car did meanwhile, and hence where to search for the next scan."""

from enum import Enum

import numpy as np

from racecar.maps.geometry.se2 import Pose

_AFTER_DRIVING = 500_000_000
"""Nanoseconds without a scan after which a car that drove, by its wheels, is placed where they say. Measured
on a simulated ring: one or two seconds ended in a map turned by a quarter."""
_AFTER_STANDING = 2_000_000_000
"""Nanoseconds without a scan after which a car that stood may have been carried. Chosen by judgement: sooner
nobody has carried it far."""
_DRIVEN_KEYFRAMES = 2.0
"""Distance since the last keyframe, relative to `keyframe_distance`, above which the car drove. Chosen by
judgement: two consecutive keyframes are never so far apart."""


class Gap(Enum):
    """What the car did since the last scan, if that was too long ago to search near it."""

    NONE = "scans came all the time"
    DRIVEN = "it drove, as its wheels say"
    LEFT_ALONE = "it stood, and may have been moved by hand"


def gap_after(nanoseconds: int, wheel_step: Pose | None, keyframe_distance: float) -> Gap:
    """Classify a gap by its duration and the wheels' step (3,) since the last keyframe."""
    least = _DRIVEN_KEYFRAMES * keyframe_distance
    has_driven = wheel_step is not None and np.hypot(wheel_step[0], wheel_step[1]) > least
    if nanoseconds <= (_AFTER_DRIVING if has_driven else _AFTER_STANDING):
        return Gap.NONE
    return Gap.DRIVEN if has_driven else Gap.LEFT_ALONE
