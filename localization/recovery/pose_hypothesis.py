"""A hypothesis of where the car is: weighed, estimated and judged by itself."""

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.pose_estimate import DOMINANT, PoseEstimate
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import PlaceJudge
from racecar.localization.sensor.end_points import EndPoints

_KNOWN_WITHIN = 0.25
"""Metres of standard deviation within which the place counts as known: points that the map does not explain
may be left out, the scan is laid on the walls, the fewest particles will do, and the place is held against
the odometry. Measured: bounds of 0.5, 0.25 and 0.1 m for these did no better (`python -m benchmarks
ablation`)."""
_TRIAL = 1_000_000_000
"""Nanoseconds that a hypothesis has before it may fail: as long as a lost car takes to be noticed
(`python -m benchmarks accuracy`)."""

_SURELY_HERE = 0.05
"""Probability of being lost below which scans tell where the surfaces of walls lie: by judgement, 20 to 1."""


class PoseHypothesis:
    """A cloud of particles, and the odds that the car is elsewhere."""

    def __init__(self, particles: ParticleFilter, judge: PlaceJudge, stamp: int) -> None:
        """The stamp (nanoseconds) is when the place was found, which the judge judges."""
        self.particles = particles
        self.judge = judge
        self.is_known = False
        """Whether the cloud lies at one place."""
        self._covariance = np.zeros((3, 3))
        """Of the last estimate while it did."""
        self._stamp = stamp
        self._is_news = False
        """Whether the scan at hand was weighed."""

    def weigh(self, points: EndPoints, travel: float, perception: Perception) -> None:
        """Take in a scan so many metres plus radians after the last.

        While the place is known, only what the map explains counts. A few particles go to where the scan lies
        on the walls, which after wrong odometry may be beside the cloud, as sure as the last estimate was.
        """
        self._is_news = True
        if self.is_known:
            map_from_base, covariance, _ = self.particles.moments()
            self.particles.propose(perception.aligned(map_from_base, covariance, points), self._covariance)
            points = perception.explained(self.particles.map_from_base, covariance, points)
        self.particles.weigh(perception.log_likelihood(self.particles.map_from_base, points), travel)

    def estimate(
        self, points: EndPoints, stamp: int, seconds: float, is_start: bool, perception: Perception
    ) -> PoseEstimate:
        """The pose by all scans so far, judged by how this one fits, so many seconds after the last."""
        map_from_base, covariance, weight = self.particles.moments()
        variance = float(covariance[0, 0] + covariance[1, 1])
        self.is_known = weight > DOMINANT and variance < _KNOWN_WITHIN**2
        if self.is_known:
            map_from_base, covariance = perception.refined(map_from_base, covariance, points)
            self._covariance = covariance
        fit = perception.fit(map_from_base, points)
        if fit is not None:
            self.judge.judge(fit, seconds)
            if self._is_news and self.is_known and self.judge.probability_lost < _SURELY_HERE:
                perception.learn_surface(map_from_base, points)
        self._is_news = False
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
        """Draw as many particles as the place needs."""
        if self.is_known:
            self.particles.resample(min(config.fewest_particles, config.particles))
        else:
            self.particles.resample(config.particles)

    def has_failed(self, stamp: int) -> bool:
        """Whether it has had its trial, and is more probably wrong than right."""
        return stamp - self._stamp >= _TRIAL and self.judge.probability_lost >= 0.5
