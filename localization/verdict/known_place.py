"""Is the car's place known, by one estimate?"""

import math

from racecar.localization.pose_estimate import DOMINANT, PoseEstimate

_LOST_FROM = 0.5
"""Probability of being elsewhere from which the car counts as lost, by definition: more likely lost than
not."""
_WITHIN = 0.5
"""Metres of standard deviation within which the place is known: by judgement, as long as a car."""


def is_lost(estimate: PoseEstimate) -> bool:
    """Whether the car is rather elsewhere."""
    return estimate.lost_probability >= _LOST_FROM


def is_place_known(estimate: PoseEstimate) -> bool:
    """Whether the car is at one place, rather than elsewhere, and that place is known well."""
    is_one_place = estimate.cluster_weight > DOMINANT
    return is_one_place and not is_lost(estimate) and deviation(estimate) < _WITHIN


def deviation(estimate: PoseEstimate) -> float:
    """Metres of standard deviation of the place, over both directions."""
    return math.sqrt(estimate.covariance[0, 0] + estimate.covariance[1, 1])
