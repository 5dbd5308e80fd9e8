"""Judge whether the car is where the filter says, by how well scans fit there, and whether better elsewhere.

A scan is evidence for the place as far as its fit exceeds a share of the usual fit, and against it as far as
it falls short. A better fit is thus never evidence against it. The usual fit is learned while the place is
beyond doubt, so that less is required on an outdated map. Where another place is compared, the one with the
higher likelihood gains.
"""

from copy import copy
from math import exp

USUAL_FIT = 0.8
"""Fit of a scan at the right place before any was seen. Chosen by judgement, between an exact map and an
outdated one, of which 0.7 of the end points lie on walls."""
_WRONG_SHARE = 0.65
"""Share of the usual fit that as many scans reach at wrong places as miss at the right one. Measured: see
`python -m benchmarks accuracy`, where a kidnapped car is noticed within a second and a tracked one not called
lost."""
_LOG_ODDS_PER_SECOND = 30.0
"""Log-odds per second and unit of fit above or below it. Measured likewise."""
_LARGEST = 6.0
"""Bound of the log-odds, 400 to 1, so that no change of mind takes long. Chosen by judgement."""
_SURE = 3.0
"""Log-odds, 20 to 1, from which the usual fit is learned. Chosen by judgement, as scans at a wrong place must
not count."""
_FIRST_SECONDS, _MEMORY_SECONDS = 2.0, 30.0
"""Seconds that the initial value counts for, and over which the usual fit is averaged. Chosen by judgement: a
room or two at walking pace."""
_LONGEST_SCAN = 0.25
"""Largest time in seconds that one scan stands for, so that none decides alone after a pause: the interval of
a slow laser."""

_COMPARED_PER_SECOND = 3.0
"""Log-likelihoods per second that count in a comparison of two places, as those at one moment have correlated
errors. Chosen by judgement: as for odometry that hangs."""
_MOST_PER_SECOND = 14.0
"""Maximum log-odds per second of such a comparison. Measured: with 20 a kidnapped car is noticed a fifth of a
second sooner, but one in a room full of moved furniture, tracked to 2 cm, was taken to be 40 m away."""


class PlaceJudge:
    """The odds that the car is at a place, by all scans since it was found there."""

    def __init__(self) -> None:
        self._usual, self._learned_seconds = USUAL_FIT, _FIRST_SECONDS
        self._log_odds = 0.0

    @property
    def probability_lost(self) -> float:
        """Probability that the car is elsewhere, 0 to 1."""
        return 1.0 / (1.0 + exp(self._log_odds))

    def for_another_place(self) -> "PlaceJudge":
        """A judge that knows the usual fit, but nothing yet about the place."""
        other = copy(self)
        other._log_odds = 0.0
        return other

    def evidence(self, fit: float) -> float:
        """Change of the log-odds in a second of scans with this fit, 0 to 1."""
        return _LOG_ODDS_PER_SECOND * (fit - _WRONG_SHARE * self._usual)

    def judge(self, fit: float, seconds: float) -> None:
        """Add the fit of a scan ``seconds`` after the last."""
        seconds = min(seconds, _LONGEST_SCAN)
        self._add(seconds * self.evidence(fit))
        if self._log_odds >= _SURE:
            self._learned_seconds = min(self._learned_seconds + seconds, _MEMORY_SECONDS)
            self._usual += seconds / self._learned_seconds * (fit - self._usual)

    def compare(self, margin: float, seconds: float) -> None:
        """Add the difference of a scan's log-likelihood here and at another place."""
        self._add(compared_evidence(margin, seconds, _COMPARED_PER_SECOND, _MOST_PER_SECOND))

    def _add(self, log_odds: float) -> None:
        self._log_odds = min(max(self._log_odds + log_odds, -_LARGEST), _LARGEST)


def compared_evidence(margin: float, seconds: float, scans_per_second: float, largest_rate: float) -> float:
    """Log-odds that a scan gives one of two poses, ``seconds`` after the last one.

    ``margin`` is the difference of its log-likelihoods. At most ``scans_per_second`` count in full, and at
    most ``largest_rate`` log-odds per second.
    """
    rate = min(max(scans_per_second * margin, -largest_rate), largest_rate)
    return rate * min(seconds, _LONGEST_SCAN)
