"""How far this car's odometry is to be trusted, learned while it drives.

The settings say how much the tyres of any car may slip. Where the filter knows the place well, the path of
the estimates is compared with that of odometry, and what the estimates' own uncertainty does not account for
is held against odometry: against its distances where the end lies farther on or back, against its turns where
that lies aside or is turned. A cloud that believes good odometry does not follow what only seems explained
elsewhere, as moved furniture does.

The slip over a segment is taken as normal, its deviation the car's own share of ``effort``; that share's
variance is the mean of what was seen, weighed by what could have been seen, and of what the settings say.
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.segments import OdometrySegment

_MEMORY = 30.0
"""By judgement: metres plus radians after which what was seen counts a third."""
_PRIOR_WEIGHT = 0.05
"""By judgement: squared metres: the slip in the settings counts like a segment whose odometry could have been
off by so much (squared)."""
_USUAL_EFFORT = 0.3
"""By judgement: share of the full effort that accounts for what odometry gets wrong without any."""
_WORST = 2.0
"""By judgement: a segment counts as off by at most so many times the slip in the settings, or else one bump
would be held against odometry for long."""


class OdometryTrust:
    """Compares odometry with the estimates, one segment of the path after the other."""

    def __init__(self) -> None:
        self._seen, self._possible = np.zeros(2), np.zeros(2)
        """Squared errors of distance and turn."""

    def slip_scale(self, slip: float) -> NDArray[np.float64]:
        """(2,) what share of the settings' slip this car's distances and turns deserve, 0 to 1."""
        if slip == 0.0:
            return np.zeros(2)
        squares = (_PRIOR_WEIGHT * slip**2 + self._seen) / (_PRIOR_WEIGHT + self._possible)
        return np.minimum(np.sqrt(squares) / slip, 1.0)

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Take in how a segment was off."""
        x, y, turn = segment.error.tolist()
        xx, yy, heading = np.diag(segment.covariance).tolist()
        place = 0.5 * (xx + yy)
        # A wrong turn carries the rest of the path aside, half of it on average.
        aside = 0.5 * segment.driven[0] * segment.pushed[1]
        usual = (_USUAL_EFFORT * segment.travel) ** 2
        possible = segment.pushed**2 + [0.0, aside**2] + usual
        seen = np.maximum([x**2 - place, y**2 + turn**2 - place - heading], 0.0)
        kept = exp(-segment.travel / _MEMORY)
        self._seen = kept * self._seen + np.minimum(seen, (_WORST * slip) ** 2 * possible)
        self._possible = kept * self._possible + possible
