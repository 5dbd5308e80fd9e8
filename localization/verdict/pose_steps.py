"""How far the estimates of a drive move, without what they jitter and jump."""

import math

from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, wrap_angle


class PoseSteps:
    """Steps between estimates that are notably apart; an estimate in between belongs to the step to come."""

    def __init__(self, distance: float, angle: float = math.inf) -> None:
        """In metres and radians, of which one must be reached."""
        self._least_distance, self._least_angle = distance, angle
        self._last: Pose | None = None

    def follow(self, estimate: PoseEstimate) -> tuple[float, float]:
        """The metres and radians of the step that ends here; 0 where none does.

        Where the estimate was searched anew, no step leads there.
        """
        pose = estimate.map_from_base
        if self._last is None or estimate.is_start:
            self._last = pose
        distance = math.hypot(pose[0] - self._last[0], pose[1] - self._last[1])
        angle = abs(float(wrap_angle(pose[2] - self._last[2])))
        if distance < self._least_distance and angle < self._least_angle:
            return 0.0, 0.0
        self._last = pose
        return distance, angle
