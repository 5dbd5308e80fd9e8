"""How far this car's odometry is to be trusted, learned while it drives.

The settings say how much the tyres of any car may slip. Where the filter knows the place well, the way it
went is compared with the way that odometry told, and what the estimates' own uncertainty does not account for
is held against odometry. A cloud that believes good odometry does not follow what only seems explained
elsewhere, as moved furniture does.

The slip over a stretch is taken as normal, its deviation the car's own share of ``effort``; that share's
variance is the mean of what was seen, weighed by what could have been seen, and of what the settings say.
"""

from math import exp, hypot, isfinite, sqrt

import numpy as np

from localization.motion_model_kernels import step_between
from localization.motion_step import MotionStep
from localization.pose_estimate import PoseEstimate
from maps.se2 import IDENTITY, Pose, compose

_STRETCH, _LONGEST_STRETCH = 1.0, 3.0
"""Metres plus radians."""
_MEMORY = 30.0
"""Metres plus radians after which what was seen counts a third."""
_SETTINGS_COUNT = 0.05
"""What the settings say counts like a stretch whose odometry could be so many metres off (squared)."""
_USUAL_EFFORT = 0.3
"""So much of the full effort makes up for what odometry gets wrong anyway."""
_WORST = 2.0
"""No stretch counts as worse than so many times what the settings say; else a bump would be held against
odometry for long."""


class OdometryTrust:
    """Compares odometry with the estimates, one stretch of the way after the other."""

    def __init__(self) -> None:
        self._seen = self._possible = 0.0
        self.start_anew()

    def start_anew(self) -> None:
        """The estimates to come do not continue those before."""
        self._begin: PoseEstimate | None = None
        self._told: Pose = IDENTITY
        self._path = self._turn = self._pushed_path = self._pushed_turn = 0.0

    def doubt(self, slip: float) -> float:
        """By what share of the slip that the settings say odometry is to be doubted, 0 to 1."""
        if slip == 0.0:
            return 0.0
        variance = (_SETTINGS_COUNT * slip**2 + self._seen) / (_SETTINGS_COUNT + self._possible)
        return min(sqrt(variance) / slip, 1.0)

    def follow(self, step: MotionStep, lag: float, estimate: PoseEstimate | None, slip: float) -> None:
        """Take in a step, and where an estimate says that it led; None where the place is not known.

        Steps count as made by a car that is behind what its odometry says, by a ``lag`` as
        `localization.slip` has it: odometry that comes early may still tell rightly how far.
        """
        if not isfinite(step.travel):
            self.start_anew()
            return
        self._go_on(step, lag)
        if estimate is None:
            return
        if self._begin is not None:
            if self._way < _STRETCH:
                return
            if self._way <= _LONGEST_STRETCH:
                self._compare(self._begin, estimate, slip)
        self.start_anew()
        self._begin = estimate

    @property
    def _way(self) -> float:
        return self._path + self._turn

    def _go_on(self, step: MotionStep, lag: float) -> None:
        self._told = compose(self._told, step.base_from_next_base + lag * step.behind)
        x, y, yaw = step.base_from_next_base.tolist()
        along, across = step.effort.tolist()
        path, turn = hypot(x, y), abs(yaw)
        self._path += path
        self._turn += turn
        self._pushed_path += along * path
        self._pushed_turn += across * turn

    def _compare(self, begin: PoseEstimate, end: PoseEstimate, slip: float) -> None:
        x, y, turn = step_between(self._told, step_between(begin.map_from_base, end.map_from_base))
        by_estimates = float(np.trace(begin.covariance) + np.trace(end.covariance))
        # A wrong turn carries the rest of the path aside, half of it on average.
        aside = 0.5 * self._path * self._pushed_turn
        possible = self._pushed_path**2 + self._pushed_turn**2 + aside**2 + (_USUAL_EFFORT * self._way) ** 2
        seen = max(x**2 + y**2 + turn**2 - by_estimates, 0.0)
        kept = exp(-self._way / _MEMORY)
        self._seen = kept * self._seen + min(seen, (_WORST * slip) ** 2 * possible)
        self._possible = kept * self._possible + possible
