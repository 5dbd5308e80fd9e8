"""Does the car stand, or does its odometry hang? Odometry that repeats one pose may mean either.

While it does, the car is followed a second time as if nothing measured its motion: from scan to scan at the
speed that it had, each time aligned with the walls. Where this track goes away, the scans decide between it
and where the car would stand.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.config import MovingRivalConfig
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose


class MovingRival:
    """The track of a car whose odometry hangs."""

    def __init__(self, last: PoseEstimate, speed: Pose, config: MovingRivalConfig) -> None:
        """It starts at the last estimate before, at a speed (3,) per second."""
        self.map_from_base = self._start = last.map_from_base
        self.speed = speed
        self._covariance = last.covariance
        self._config = config
        self._log_odds = 0.0

    def follow(
        self,
        seconds: float,
        align: Callable[[Pose, NDArray[np.float64]], Pose],
        log_likelihood: Callable[[Pose], NDArray[np.float64]],
    ) -> None:
        """Take in a scan so many seconds after the last.

        ``align`` puts a pose (3,) of some covariance
        (3, 3) on the walls, and the log-likelihood is that of the scan from poses (N, 3).
        """
        config = self._config
        predicted = compose(self.map_from_base, self.speed * seconds)
        aligned = align(predicted, self._covariance)
        measured = between(self.map_from_base, aligned) / max(seconds, 1e-3)
        share = seconds / (seconds + config.speed_seconds)
        self.speed = self.speed + share * (measured - self.speed)
        self.map_from_base = aligned
        if not are_apart(aligned, self._start, (config.apart_distance, config.apart_angle)):
            self._log_odds = 0.0
            return
        moving, stood = log_likelihood(np.stack([aligned, self._start])).tolist()
        if moving > stood and np.abs(self.speed).max() < config.least_speed:
            return
        rate, most = config.scans_per_second * (moving - stood), config.largest_rate
        self._log_odds += min(max(rate, -most), most) * min(seconds, config.longest_scan)

    @property
    def has_won(self) -> bool:
        """Whether the car moves, by all evidence."""
        return self._log_odds >= self._config.winning_log_odds

    @property
    def has_failed(self) -> bool:
        """Whether it does not as this track has it."""
        return self._log_odds <= -self._config.winning_log_odds
