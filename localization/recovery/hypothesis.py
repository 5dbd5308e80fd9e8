"""A second hypothesis of where the car is, which has to prove itself while the car drives."""

import numpy as np

from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.config import HypothesisConfig
from racecar.localization.recovery.lost_detector import LostDetector


class PoseHypothesis:
    """A second cloud of particles, and its odds against the first."""

    def __init__(
        self, filter: ParticleFilter, lost: LostDetector, stamp: int, config: HypothesisConfig
    ) -> None:
        """The stamp (nanoseconds) is when the cloud's place was found; the detector judges that place."""
        self.filter = filter
        self.lost = lost
        self._stamp = stamp
        self._config = config
        self._log_odds = 0.0

    def compare(self, advantage: float, seconds: float, is_moving: bool) -> None:
        """Take in by how much the log-likelihood of a scan is larger in this cloud than in the first."""
        config = self._config
        rate = float(np.clip(config.scans_per_second * advantage, -config.largest_rate, config.largest_rate))
        weight = 1.0 if is_moving else config.standing_share
        self._log_odds += rate * min(seconds, self.lost.longest_scan) * weight

    @property
    def has_won(self) -> bool:
        """Whether this cloud is to replace the first: more likely, and in good agreement with the map."""
        is_likelier = self._log_odds >= self._config.winning_log_odds
        return is_likelier and self.lost.probability < self._config.good_probability

    def has_failed(self, stamp: int) -> bool:
        """Whether it has had its trial, and is more probably wrong than right."""
        seconds = (stamp - self._stamp) * 1e-9
        return seconds >= self._config.trial_seconds and self.lost.probability >= 0.5
