"""Is the car where the filter thinks? Told from how scans agree with the map, against what they usually do.

A beam agrees with the map closely or roughly, is stopped before the wall, as by people, or looks through it,
which nothing but a changed map excuses. At the right place their shares are learned while the car is tracked;
at wrong places they are what the map's own places give when they are taken for each other, be they hardly or
very much alike. Bayes' rule turns scans into the odds of being lost. Until the shares at the right place are
learned, scans also tell what kind of map it is: one that is as the world is, or one where much has changed.
"""

from copy import copy
from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.recovery.lost_detector_kernels import count_agreeing, evidence_against
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose

ALIKE, ALIKE_SHARE = 0.25, 0.02
"""Metres, and share of the range, within which a reading agrees with the map."""
CLOSE = 0.4
"""Share of that within which it agrees closely."""
LIKENESS_QUANTILES = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 0.99, 1.0])
"""Pairs of places are sorted by how much they look alike and parted here, finely among those that do."""
_SHARES_OF_PAIRS = np.diff(LIKENESS_QUANTILES)
_USUAL_SHARES = np.array([[0.7, 0.15, 0.12, 0.03], [0.6, 0.1, 0.15, 0.15]])
"""Of beams that agree closely, roughly, are stopped, look through, at the right place: a row for each kind of
map."""
_USUALLY = np.array([0.9, 0.1])
"""How likely a map is of each kind."""
_LEAST_LIKELY = np.log(0.01)
"""Beside the likeliest kind, so that a change of mind takes no longer than that."""
_LEAST_SHARES = np.array([0.05, 0.05, 0.06, 0.01])
"""None is taken for less."""
_FIRST_SECONDS, _MEMORY_SECONDS = 2.0, 30.0
"""As long as the usual shares count, and as long as scans are remembered."""
_BEAMS_PER_SECOND = 110.0
"""So many independent ones are a second's scans worth: its beams are alike in what disturbs them."""
_CLOUDING, _LEAST_CLARITY = 4.5, 0.15
LONGEST = 0.25
"""Seconds that one scan stands for at most."""
_SUREST = 6.0
"""Log-odds; nothing is believed more firmly, so that no change of mind takes long."""
_SURE = 3.0
"""Log-odds against being lost from which on the shares at the right place are learned."""


class LostDetector:
    """Weighs two explanations of every scan: tracked, and lost."""

    def __init__(self, shares_when_lost: NDArray[np.float64]) -> None:
        """Shares (K, 4) of beams that agree closely, roughly, are stopped, look through: at wrong places.

        A row for each part of the pairs between `LIKENESS_QUANTILES`.
        """
        self._log_when_lost = np.log(_normalized(np.maximum(shares_when_lost, _LEAST_SHARES)))
        self._log_kinds: NDArray[np.float64]
        self._when_tracked: NDArray[np.float64]
        self._forget_kind()
        self._learned_seconds = _FIRST_SECONDS
        self._log_odds = 0.0

    @property
    def probability(self) -> float:
        """How likely the car is elsewhere, 0 to 1."""
        return 1.0 / (1.0 + exp(-self._log_odds))

    @property
    def clarity(self) -> float:
        """How much a scan counts, 0 to 1: less where many beams disagree at the right place too."""
        _, _, stopped, looking_through = self._when_tracked.tolist()
        return max(1.0 - _CLOUDING * float(stopped + looking_through), _LEAST_CLARITY)

    def for_another_place(self) -> "LostDetector":
        """One that knows what this has learned of the sensor, but nothing yet of the place."""
        other = copy(self)
        other._log_odds = 0.0
        if not self._has_learned:
            other._forget_kind()
        return other

    def evidence(self, shares: NDArray[np.float64]) -> float:
        """By how much the log-odds of being lost rise in a second of scans with such shares (4,)."""
        beams = _BEAMS_PER_SECOND * self.clarity
        return evidence_against(
            shares, self._when_tracked, _LEAST_SHARES, self._log_when_lost, _SHARES_OF_PAIRS, beams
        )

    def judge(self, shares: NDArray[np.float64], seconds: float) -> None:
        """Take in the shares (4,) of a scan, so long after the one before."""
        seconds = min(seconds, LONGEST)
        if not self._has_learned:
            self._tell_kind(shares, seconds)
        self._log_odds = min(max(self._log_odds + seconds * self.evidence(shares), -_SUREST), _SUREST)
        if self._log_odds <= -_SURE:
            self._learned_seconds = min(self._learned_seconds + seconds, _MEMORY_SECONDS)
            blend = seconds / self._learned_seconds
            self._when_tracked = self._when_tracked + blend * (shares - self._when_tracked)

    @property
    def _has_learned(self) -> bool:
        return self._learned_seconds > _FIRST_SECONDS

    def _forget_kind(self) -> None:
        self._log_kinds = np.log(_USUALLY)
        self._when_tracked = _USUALLY @ _USUAL_SHARES

    def _tell_kind(self, shares: NDArray[np.float64], seconds: float) -> None:
        """Weigh the kinds of maps by a scan's shares (4,), as if it came from the right place."""
        beams = seconds * _BEAMS_PER_SECOND * self.clarity
        self._log_kinds = self._log_kinds + beams * (np.log(_USUAL_SHARES) @ shares)
        self._log_kinds = np.maximum(self._log_kinds - self._log_kinds.max(), _LEAST_LIKELY)
        self._when_tracked = _normalized(np.exp(self._log_kinds)) @ _USUAL_SHARES


def agreement_shares(map_from_base: Pose, beams: Beams, free_space: FreeSpace) -> NDArray[np.float64] | None:
    """(4,) shares of the beams from a pose (3,) that agree closely, roughly, are shorter, are longer.

    None when there are no beams, or where the laser cannot be.
    """
    counts = count_agreeing(
        map_from_base,
        beams.base_from_laser,
        free_space.grid_in_map,
        free_space.grid.cells,
        free_space.is_open,
        beams.bearings,
        beams.ranges,
        beams.max_range,
        ALIKE,
        ALIKE_SHARE,
        CLOSE,
    )
    total = counts.sum()
    return counts / total if total > 0 else None


def _normalized(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    normalized: NDArray[np.float64] = shares / shares.sum(axis=-1, keepdims=True)
    return normalized
