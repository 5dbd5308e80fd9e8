"""Is the car where the filter says? Judged by how well scans fit the map there, and whether elsewhere better.

A scan speaks for the place by as much as its fit exceeds a share of the usual fit, and against it by as much
as it falls short; so one that fits better never says that the car is elsewhere. The usual fit is learned
while the place is right beyond doubt: on a map that is out of date less is asked of a scan. And where another
place is compared with, the one speaks that the scan fits better.
"""

from copy import copy
from math import exp

USUAL_FIT = 0.8
"""Of a scan at the right place before any was seen. By judgement, between an exact map and one that is out of
date, of which 0.7 of the end points lie on walls."""
_WRONG_SHARE = 0.65
"""Of the usual fit, that as many scans reach at wrong places as at the right one stay below. Measured: see
`python -m benchmarks accuracy`, where a kidnapped car is noticed within a second and a tracked one not called
lost."""
_LOG_ODDS_PER_SECOND = 30.0
"""For each unit of fit above or below that. Measured likewise."""
_LARGEST = 6.0
"""Log-odds, 400 to 1: bounded, so that no change of mind takes long. By judgement."""
_SURE = 3.0
"""Log-odds, 20 to 1, from which on the usual fit is learned: by judgement, as scans of a wrong place
are not to count."""
_FIRST_SECONDS, _MEMORY_SECONDS = 2.0, 30.0
"""For which what is expected at first counts, and over which the usual fit is averaged: by judgement,
a room or two at walking pace."""
_LONGEST_SCAN = 0.25
"""Seconds that one scan stands for at most, so that none decides alone after a pause: the time between scans
of a slow laser."""

_COMPARED_PER_SECOND = 3.0
"""Scans whose log-likelihoods count in a second where two places are compared, as those of a moment err
alike: by judgement, as for odometry that hangs."""
_MOST_PER_SECOND = 14.0
"""Log-odds that such a comparison brings at most. Measured: with 20 a kidnapped car is noticed a fifth of a
second sooner, but one in a room full of moved furniture, tracked to 2 cm, was taken to be 40 m away."""


class PlaceJudge:
    """The odds that the car is at a place, by all scans since it was found there."""

    def __init__(self) -> None:
        self._usual, self._learned_seconds = USUAL_FIT, _FIRST_SECONDS
        self._log_odds = 0.0

    @property
    def probability_lost(self) -> float:
        """How likely the car is elsewhere, 0 to 1."""
        return 1.0 / (1.0 + exp(self._log_odds))

    def for_another_place(self) -> "PlaceJudge":
        """One that knows what scans usually fit, but nothing yet of the place."""
        other = copy(self)
        other._log_odds = 0.0
        return other

    def evidence(self, fit: float) -> float:
        """By how much the log-odds of the place rise in a second of scans that fit so well, 0 to 1."""
        return _LOG_ODDS_PER_SECOND * (fit - _WRONG_SHARE * self._usual)

    def judge(self, fit: float, seconds: float) -> None:
        """Take in the fit of a scan, so many seconds after the one before."""
        seconds = min(seconds, _LONGEST_SCAN)
        self._add(seconds * self.evidence(fit))
        if self._log_odds >= _SURE:
            self._learned_seconds = min(self._learned_seconds + seconds, _MEMORY_SECONDS)
            self._usual += seconds / self._learned_seconds * (fit - self._usual)

    def compare(self, margin: float, seconds: float) -> None:
        """Take in by how much the log-likelihood of a scan is higher here than at another place."""
        self._add(compared_evidence(margin, seconds, _COMPARED_PER_SECOND, _MOST_PER_SECOND))

    def _add(self, log_odds: float) -> None:
        self._log_odds = min(max(self._log_odds + log_odds, -_LARGEST), _LARGEST)


def compared_evidence(margin: float, seconds: float, scans_per_second: float, largest_rate: float) -> float:
    """Log-odds by which a scan speaks for one of two poses, so many seconds after the last.

    Its log-likelihood there is higher by a ``margin``. So many scans count in a second, and bring at most so
    much in one.
    """
    rate = min(max(scans_per_second * margin, -largest_rate), largest_rate)
    return rate * min(seconds, _LONGEST_SCAN)
