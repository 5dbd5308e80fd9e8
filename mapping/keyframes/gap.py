"""Times without scans: what the car did meanwhile, and so where the next scan is to be sought."""

from enum import Enum

import numpy as np

from racecar.mapping.keyframes.config import GapConfig
from racecar.maps.geometry.se2 import Pose

_SECOND = 1_000_000_000
"""Nanoseconds, by definition."""


class Gap(Enum):
    """What the car did since the last scan, where that is too long ago to seek the next one about it."""

    NONE = "scans came all the time"
    DRIVEN = "it drove, as its wheels say"
    LEFT_ALONE = "it stood, and may have been moved by hand"


def gap_after(nanoseconds: int, wheel_step: Pose | None, keyframe_distance: float, config: GapConfig) -> Gap:
    """What so many nanoseconds without a scan are, by the wheels' step (3,) since the last keyframe."""
    least = config.driven_keyframes * keyframe_distance
    has_driven = wheel_step is not None and np.hypot(wheel_step[0], wheel_step[1]) > least
    longest = config.after_driving if has_driven else config.after_standing
    if nanoseconds <= longest * _SECOND:
        return Gap.NONE
    return Gap.DRIVEN if has_driven else Gap.LEFT_ALONE
