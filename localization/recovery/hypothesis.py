"""Another opinion on where the car is, which has to prove itself while the car drives."""

import numpy as np

from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.lost_detector import LONGEST, LostDetector

_COUNTS_PER_SECOND = 0.2
"""So many scans' log-likelihoods count in a second: what disturbs one disturbs the next ones too."""
_MOST_PER_SECOND = 16.0
_WHILE_STANDING = 0.1
"""Share of that for a scan without motion, which repeats the one before."""
_DECIDED = 10.0
_TRIAL_SECONDS = 1.0
_GOOD = 0.02
"""Probability of being lost below which a place is good."""


class PoseHypothesis:
    """A second cloud of particles, and the odds for it against the first."""

    def __init__(self, filter: ParticleFilter, lost: LostDetector, stamp: int) -> None:
        """The stamp tells when the place of the cloud was found, the detector whether it is a good one."""
        self.filter = filter
        self.lost = lost
        self._stamp = stamp
        self._log_odds = 0.0

    def compare(self, advantage: float, seconds: float, is_moving: bool) -> None:
        """Take in by how much the log-likelihood of a scan is larger in this cloud than in the first."""
        rate = float(np.clip(_COUNTS_PER_SECOND * advantage, -_MOST_PER_SECOND, _MOST_PER_SECOND))
        self._log_odds += rate * min(seconds, LONGEST) * (1.0 if is_moving else _WHILE_STANDING)

    @property
    def has_won(self) -> bool:
        """Whether this cloud is to take the place of the first: better than that, and good."""
        return self._log_odds >= _DECIDED and self.lost.probability < _GOOD

    def has_failed(self, stamp: int) -> bool:
        """Whether it had its time, and is rather wrong itself."""
        return (stamp - self._stamp) * 1e-9 >= _TRIAL_SECONDS and self.lost.probability >= 0.5
