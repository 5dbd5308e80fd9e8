"""One hypothesis of the car's pose, with its own particles, estimate and odds."""

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.pose_estimate import DOMINANT, PoseEstimate
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import PlaceJudge
from racecar.localization.sensor.end_points import EndPoints

_KNOWN_WITHIN = 0.25
"""Standard deviation in metres within which the place is known: points that the map does not explain may be
left out, the scan is aligned with the walls, the fewest particles suffice, and odometry is checked against
it. Measured: bounds of 0.5, 0.25 and 0.1 m for these did no better (`python -m benchmarks ablation`)."""
_TRIAL = 1_000_000_000
"""Nanoseconds before a hypothesis may fail: as long as a lost car takes to be noticed (`python -m benchmarks
accuracy`)."""

_SURELY_HERE = 0.05
"""Probability of being lost below which scans show the surface of walls. Chosen by judgement: 20 to 1."""


class PoseHypothesis:
    """A cloud of particles, and the odds that the car is elsewhere."""

    def __init__(self, particles: ParticleFilter, judge: PlaceJudge, stamp: int) -> None:
        """``stamp`` (nanoseconds) is when the place to judge was found."""
        self.particles = particles
        self.judge = judge
        self.is_known = False
        """Whether the cloud is at one place."""
        self._covariance = np.zeros((3, 3))
        """Covariance of the last estimate while it was."""
        self._stamp = stamp
        self._is_weighted = False
        """Whether the current scan was weighted."""

    def weigh(self, points: EndPoints, travel: float, perception: Perception) -> None:
        """Add a scan ``travel`` metres plus radians after the last.

        While the place is known, only points that the map explains count. A few particles are proposed where
        the scan aligns with walls, perhaps outside the cloud, with the last estimate's covariance.
        """
        self._is_weighted = True
        if self.is_known:
            map_from_base, covariance, _ = self.particles.moments()
            self.particles.propose(perception.aligned(map_from_base, covariance, points), self._covariance)
            points = perception.explained(self.particles.map_from_base, covariance, points)
        self.particles.weigh(perception.log_likelihood(self.particles.map_from_base, points), travel)

    def estimate(
        self, points: EndPoints, stamp: int, seconds: float, is_start: bool, perception: Perception
    ) -> PoseEstimate:
        """The pose given all scans, judged by the fit of this one, ``seconds`` after the last."""
        map_from_base, covariance, weight = self.particles.moments()
        variance = float(covariance[0, 0] + covariance[1, 1])
        self.is_known = weight > DOMINANT and variance < _KNOWN_WITHIN**2
        if self.is_known:
            map_from_base, covariance = perception.refined(map_from_base, covariance, points)
            self._covariance = covariance
        fit = perception.fit(map_from_base, points)
        if fit is not None:
            self.judge.judge(fit, seconds)
            if self._is_weighted and self.is_known and self.judge.probability_lost < _SURELY_HERE:
                perception.learn_surface(map_from_base, points)
        self._is_weighted = False
        return PoseEstimate(
            stamp=stamp,
            map_from_base=map_from_base,
            covariance=covariance,
            cluster_weight=weight,
            effective_sample_size=self.particles.effective_size,
            particle_count=len(self.particles),
            is_start=is_start,
            lost_probability=1.0 - (1.0 - self.judge.probability_lost) * weight,
            fit=fit,
        )

    def resample(self, config: LocalizationConfig) -> None:
        """Resample to as many particles as the uncertainty requires."""
        if self.is_known:
            self.particles.resample(min(config.fewest_particles, config.particles))
        else:
            self.particles.resample(config.particles)

    def has_failed(self, stamp: int) -> bool:
        """Whether its trial is over and it is more probably wrong than right."""
        return stamp - self._stamp >= _TRIAL and self.judge.probability_lost >= 0.5
