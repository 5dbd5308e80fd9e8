"""Distance covered by the estimates of a drive, without jitter and jumps."""

import math

from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, wrap_angle


class PoseSteps:
    """Steps between sufficiently distant estimates; those in between belong to the next step."""

    def __init__(self, distance: float, angle: float = math.inf) -> None:
        """Thresholds in metres and radians; a step ends when either is reached."""
        self._least_distance, self._least_angle = distance, angle
        self._last: Pose | None = None

    def follow(self, estimate: PoseEstimate) -> tuple[float, float]:
        """Metres and radians of the step that ends here; 0 if none does.

        No step leads to an estimate from a new search.
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
