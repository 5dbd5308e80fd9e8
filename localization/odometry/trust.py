"""How far this car's odometry is to be trusted, learned while it drives.

The settings say how much the tyres of any car may slip. Where the filter knows the place well, the way it
went is compared with the way that odometry told, and what the estimates' own uncertainty does not account
for is held against odometry: against its way where the end lies farther on or back, against its turn where
that lies aside or is turned. A cloud that believes good odometry does not follow what only seems explained
elsewhere, as moved furniture does.

The slip over a stretch is taken as normal, its deviation the car's own share of ``effort``; that share's
variance is the mean of what was seen, weighed by what could have been seen, and of what the settings say.
"""

from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.segments import OdometryStretch

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
        self._seen, self._possible = np.zeros(2), np.zeros(2)
        """Squared errors of way and turn."""

    def doubt(self, slip: float) -> NDArray[np.float64]:
        """(2,) by what share of the slip that the settings say way and turn are to be doubted, 0 to 1."""
        if slip == 0.0:
            return np.zeros(2)
        squares = zip(self._seen.tolist(), self._possible.tolist(), strict=True)
        usual = _SETTINGS_COUNT * slip**2
        shares = [sqrt((usual + seen) / (_SETTINGS_COUNT + possible)) / slip for seen, possible in squares]
        return np.minimum(shares, 1.0)

    def learn(self, stretch: OdometryStretch, slip: float) -> None:
        """Take in how a stretch was off."""
        x, y, turn = stretch.error.tolist()
        place, heading = (stretch.begin_variances + stretch.end_variances).tolist()
        # A wrong turn carries the rest of the path aside, half of it on average.
        aside = 0.5 * stretch.path * stretch.pushed_turn
        usual = (_USUAL_EFFORT * stretch.way) ** 2
        possible = np.array([stretch.pushed_path**2, stretch.pushed_turn**2 + aside**2]) + usual
        seen = np.maximum([x**2 - place, y**2 + turn**2 - place - heading], 0.0)
        kept = exp(-stretch.way / _MEMORY)
        self._seen = kept * self._seen + np.minimum(seen, (_WORST * slip) ** 2 * possible)
        self._possible = kept * self._possible + possible
