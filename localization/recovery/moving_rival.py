"""Does the car stand, or does its odometry hang? Odometry that repeats one pose may mean either.

While it does, the car is followed a second time as if nothing measured its motion: from scan to scan at the
speed that it had, each time aligned with the walls. Where this track goes away, the scans decide between it
and where the car would stand.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_APART = (0.1, 0.05)
"""Metres and radians from where the car would stand, beyond which scans can decide which is right, since that
is some times the error of either. By judgement."""
_SPEED_SECONDS = 0.15
"""Over which its speed is averaged, since alignments scatter: by judgement, as where there is no odometry."""
_LEAST_SPEED = 0.1
"""Metres or radians per second below which a better fit does not count, since a car whose wheels locked
stands in the end, a little farther on. By judgement."""
_SCANS_PER_SECOND = 2.0
"""Whose log-likelihoods count, since those of a moment err alike. By judgement."""
_LARGEST_RATE = 30.0
"""Log-odds that a second may bring at most, so that a third of a second decides if all is clear. By
judgement."""
_LONGEST_SCAN = 0.25
"""Seconds that one scan stands for at most, so that none decides alone after a pause. By judgement, as for
being lost."""
_WINNING_LOG_ODDS = 10.0
"""Over a car that stands, 20 000 to 1, since to leave out odometry that is right costs more than to wait. By
judgement."""


class MovingRival:
    """The track of a car whose odometry hangs."""

    def __init__(self, last: PoseEstimate, speed: Pose) -> None:
        """It starts at the last estimate before, at a speed (3,) per second."""
        self.map_from_base = self._start = last.map_from_base
        self.speed = speed
        self._covariance = last.covariance
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
        predicted = compose(self.map_from_base, self.speed * seconds)
        aligned = align(predicted, self._covariance)
        measured = between(self.map_from_base, aligned) / max(seconds, 1e-3)
        share = seconds / (seconds + _SPEED_SECONDS)
        self.speed = self.speed + share * (measured - self.speed)
        self.map_from_base = aligned
        if not are_apart(aligned, self._start, _APART):
            self._log_odds = 0.0
            return
        moving, stood = log_likelihood(np.stack([aligned, self._start])).tolist()
        if moving > stood and np.abs(self.speed).max() < _LEAST_SPEED:
            return
        rate = min(max(_SCANS_PER_SECOND * (moving - stood), -_LARGEST_RATE), _LARGEST_RATE)
        self._log_odds += rate * min(seconds, _LONGEST_SCAN)

    @property
    def has_won(self) -> bool:
        """Whether the car moves, by all evidence."""
        return self._log_odds >= _WINNING_LOG_ODDS

    @property
    def has_failed(self) -> bool:
        """Whether it does not as this track has it."""
        return self._log_odds <= -_WINNING_LOG_ODDS
