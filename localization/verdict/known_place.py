"""Is the car's place known, by one estimate?"""

import math

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.config import KnownPlaceConfig


def is_lost(estimate: PoseEstimate, config: KnownPlaceConfig) -> bool:
    """Whether the car is rather elsewhere."""
    return estimate.lost_probability >= config.lost_from


def is_place_known(estimate: PoseEstimate, config: KnownPlaceConfig) -> bool:
    """Whether the car is at one place, rather than elsewhere, and that place is known well."""
    is_one_place = estimate.cluster_weight > config.dominant
    return is_one_place and not is_lost(estimate, config) and deviation(estimate) < config.within


def deviation(estimate: PoseEstimate) -> float:
    """Metres of standard deviation of the place, over both directions."""
    return math.sqrt(estimate.covariance[0, 0] + estimate.covariance[1, 1])
