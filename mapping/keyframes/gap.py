"""Times without scans: what the car did meanwhile, and so where the next scan is to be sought."""

from enum import Enum

import numpy as np

from racecar.maps.geometry.se2 import Pose

_AFTER_DRIVING = 500_000_000
"""Nanoseconds without a scan, after which a car that drove, as its wheels say, is placed where they put it.
Measured on a simulated ring: one or two seconds ended in a map turned by a quarter."""
_AFTER_STANDING = 2_000_000_000
"""Nanoseconds without a scan, after which a car that stood may have been moved by hand. By judgement: sooner
nobody has carried it far."""
_DRIVEN_KEYFRAMES = 2.0
"""By what factor the distance since the last keyframe must exceed `keyframe_distance` for the car to have
driven. By judgement: two keyframes in a row are never so far apart."""


class Gap(Enum):
    """What the car did since the last scan, where that is too long ago to seek the next one about it."""

    NONE = "scans came all the time"
    DRIVEN = "it drove, as its wheels say"
    LEFT_ALONE = "it stood, and may have been moved by hand"


def gap_after(nanoseconds: int, wheel_step: Pose | None, keyframe_distance: float) -> Gap:
    """What so many nanoseconds without a scan are, by the wheels' step (3,) since the last keyframe."""
    least = _DRIVEN_KEYFRAMES * keyframe_distance
    has_driven = wheel_step is not None and np.hypot(wheel_step[0], wheel_step[1]) > least
    if nanoseconds <= (_AFTER_DRIVING if has_driven else _AFTER_STANDING):
        return Gap.NONE
    return Gap.DRIVEN if has_driven else Gap.LEFT_ALONE
