"""Is the car where the filter says? Judged by how scans agree with the map, and how they usually do.

A beam agrees with the map closely or roughly, is stopped before the wall, as by people, or looks through it,
which nothing but a changed map excuses. At the right place their shares are learned while the car is tracked;
at wrong places they are those of the map's own places when these are taken for each other, from places that
hardly look alike to places that nearly look the same. Bayes' rule turns scans into the odds of being lost.
Until the shares at the right place are learned, scans also decide what kind of map it is: one that is as the
world is, or one where much has changed.
"""

from copy import copy
from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.recovery.config import AgreementShares, LostDetectorConfig
from racecar.localization.recovery.lost_detector_kernels import evidence_against

LIKENESS_QUANTILES = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 0.99, 1.0])
"""Pairs of places are sorted by how much they look alike and grouped between these, more finely at the end
since the places that nearly look the same decide."""
_SHARES_OF_PAIRS = np.diff(LIKENESS_QUANTILES)


class LostDetector:
    """Weighs two explanations of every scan: tracked, and lost."""

    def __init__(self, shares_when_lost: NDArray[np.float64], config: LostDetectorConfig) -> None:
        """Shares (K, 4) of beams that agree closely, roughly, are stopped, look through: at wrong places.

        A row for each group of pairs between `LIKENESS_QUANTILES`.
        """
        self._config = config
        self._least_shares = as_array(config.least_shares)
        self._usual_shares = np.array([as_array(config.unchanged_map), as_array(config.changed_map)])
        self._log_when_lost = np.log(_normalized(np.maximum(shares_when_lost, self._least_shares)))
        self._log_kinds: NDArray[np.float64]
        """(2,) of an unchanged map and of a changed one."""
        self._when_tracked: NDArray[np.float64]
        """(4,) shares at the right place."""
        self._forget_kind()
        self._learned_seconds = config.first_seconds
        self._log_odds = 0.0

    @property
    def probability(self) -> float:
        """How likely the car is elsewhere, 0 to 1."""
        return 1.0 / (1.0 + exp(-self._log_odds))

    @property
    def clarity(self) -> float:
        """How much a scan counts, 0 to 1: less where many beams disagree at the right place too."""
        _, _, stopped, looking_through = self._when_tracked.tolist()
        disagreeing = float(stopped + looking_through)
        return max(1.0 - self._config.clarity_per_share * disagreeing, self._config.least_clarity)

    def for_another_place(self) -> "LostDetector":
        """One that knows what this has learned of the sensor, but nothing yet of the place."""
        other = copy(self)
        other._log_odds = 0.0
        if not self._has_learned:
            other._forget_kind()
        return other

    def evidence(self, shares: NDArray[np.float64]) -> float:
        """By how much the log-odds of being lost rise in a second of scans with such shares (4,)."""
        beams = self._config.beams_per_second * self.clarity
        return evidence_against(
            shares, self._when_tracked, self._least_shares, self._log_when_lost, _SHARES_OF_PAIRS, beams
        )

    def judge(self, shares: NDArray[np.float64], seconds: float) -> None:
        """Take in the shares (4,) of a scan, so many seconds after the one before."""
        config, seconds = self._config, min(seconds, self._config.longest_scan)
        if not self._has_learned:
            self._weigh_kinds(shares, seconds)
        log_odds, largest = self._log_odds + seconds * self.evidence(shares), config.largest_log_odds
        self._log_odds = min(max(log_odds, -largest), largest)
        if self._log_odds <= -config.learning_log_odds:
            self._learned_seconds = min(self._learned_seconds + seconds, config.memory_seconds)
            blend = seconds / self._learned_seconds
            self._when_tracked = self._when_tracked + blend * (shares - self._when_tracked)

    @property
    def _has_learned(self) -> bool:
        return self._learned_seconds > self._config.first_seconds

    def _forget_kind(self) -> None:
        changed = self._config.changed_map_probability
        prior = np.array([1.0 - changed, changed])
        self._log_kinds = np.log(prior)
        self._when_tracked = prior @ self._usual_shares

    def _weigh_kinds(self, shares: NDArray[np.float64], seconds: float) -> None:
        """Weigh the kinds of maps by a scan's shares (4,), as if it came from the right place."""
        beams = seconds * self._config.beams_per_second * self.clarity
        self._log_kinds = self._log_kinds + beams * (np.log(self._usual_shares) @ shares)
        least = np.log(self._config.least_kind_probability)
        self._log_kinds = np.maximum(self._log_kinds - self._log_kinds.max(), least)
        self._when_tracked = _normalized(np.exp(self._log_kinds)) @ self._usual_shares


def as_array(shares: AgreementShares) -> NDArray[np.float64]:
    """(4,)"""
    return np.array([shares.closely, shares.roughly, shares.stopped, shares.looking_through])


def _normalized(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    normalized: NDArray[np.float64] = shares / shares.sum(axis=-1, keepdims=True)
    return normalized
