"""Learns while driving how far this car's odometry can be trusted.

The settings state how much the tyres of any car may slip. Where the pose is well known, the path of the
estimates is compared with odometry. Errors beyond the estimates' own uncertainty count against odometry:
against its distances if the end is too far or too near, against its turns if it is off to the side or
rotated. Particles that trust good odometry do not follow spurious matches, as with moved furniture.

The slip over a segment is assumed normal, with a deviation of the car's own share of ``effort``. Its variance
is the mean of the slip observed, weighted by the slip possible, and that in the settings.
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.segments import OdometrySegment

_MEMORY = 30.0
"""Metres plus radians after which the weight of an observation falls to a third. Chosen by judgement."""
_PRIOR_WEIGHT = 0.05
"""Squared metres: the slip in the settings has the weight of a segment with this possible error (squared).
Chosen by judgement."""
_USUAL_EFFORT = 0.3
"""Share of the full effort that stands for odometry errors without any effort. Chosen by judgement."""
_WORST = 2.0
"""Cap on the error of a segment, as a multiple of the slip in the settings; otherwise one bump would reduce
trust in odometry for a long time. Chosen by judgement."""


class OdometryTrust:
    """Compares odometry with the estimates, segment by segment."""

    def __init__(self) -> None:
        self._seen, self._possible = np.zeros(2), np.zeros(2)
        """Squared errors of distance and turn."""

    def slip_scale(self, slip: float) -> NDArray[np.float64]:
        """(2,) share of the configured slip that applies to this car's distances and turns, 0 to 1."""
        if slip == 0.0:
            return np.zeros(2)
        squares = (_PRIOR_WEIGHT * slip**2 + self._seen) / (_PRIOR_WEIGHT + self._possible)
        return np.minimum(np.sqrt(squares) / slip, 1.0)

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Update with the error of a segment."""
        x, y, turn = segment.error.tolist()
        xx, yy, heading = np.diag(segment.covariance).tolist()
        place = 0.5 * (xx + yy)
        # On average a wrong turn displaces half of the remaining path sideways.
        aside = 0.5 * segment.driven[0] * segment.pushed[1]
        usual = (_USUAL_EFFORT * segment.travel) ** 2
        possible = segment.pushed**2 + [0.0, aside**2] + usual
        seen = np.maximum([x**2 - place, y**2 + turn**2 - place - heading], 0.0)
        kept = exp(-segment.travel / _MEMORY)
        self._seen = kept * self._seen + np.minimum(seen, (_WORST * slip) ** 2 * possible)
        self._possible = kept * self._possible + possible
