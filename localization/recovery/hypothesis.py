"""A hypothesis of where the car is. The first one is believed; a second one is found when that seems lost."""

from dataclasses import dataclass

from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.config import HypothesisConfig
from racecar.localization.recovery.lost_detector import LostDetector


@dataclass(eq=False)
class PoseHypothesis:
    """A cloud of particles, and the odds that the car is elsewhere."""

    filter: ParticleFilter
    lost: LostDetector
    """Judges this cloud's place."""
    stamp: int
    """Nanoseconds: when the place was found."""

    def is_confirmed(self, config: HypothesisConfig) -> bool:
        """Whether scans agree with the map so well that the car is there: no other place matters then."""
        return self.lost.probability < config.confirmed_below

    def has_failed(self, stamp: int, config: HypothesisConfig) -> bool:
        """Whether it has had its trial, and is more probably wrong than right."""
        return (stamp - self.stamp) * 1e-9 >= config.trial_seconds and self.lost.probability >= 0.5
