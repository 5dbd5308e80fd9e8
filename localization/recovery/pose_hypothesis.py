"""A hypothesis of where the car is: weighed, estimated and judged by itself."""

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import PlaceJudge
from racecar.localization.sensor.beams import Beams


class PoseHypothesis:
    """A cloud of particles, and the odds that the car is elsewhere."""

    def __init__(self, particles: ParticleFilter, judge: PlaceJudge, stamp: int) -> None:
        """The stamp (nanoseconds) is when the place was found, which the judge judges."""
        self.particles = particles
        self.judge = judge
        self.is_known = False
        """Whether the cloud lies at one place."""
        self._stamp = stamp

    def weigh(self, beams: Beams, travel: float, perception: Perception) -> None:
        """Take in a scan so many metres plus radians after the last."""
        self.particles.weigh_next(perception.log_likelihood(self.particles.map_from_base, beams), travel)

    def estimate(
        self, beams: Beams, stamp: int, seconds: float, is_start: bool, perception: Perception
    ) -> PoseEstimate:
        """The pose by all scans so far, judged by how this one fits, so many seconds after the last."""
        map_from_base, covariance, weight = self.particles.moments()
        tracking = perception.config.tracking
        variance = float(covariance[0, 0] + covariance[1, 1])
        self.is_known = weight > tracking.dominant and variance < tracking.known_within**2
        if self.is_known:
            map_from_base, covariance = perception.aligned(map_from_base, covariance, beams)
        fit = perception.fit(map_from_base, beams)
        if fit is not None:
            self.judge.judge(fit, seconds)
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
            self.particles.resample(max(config.particles, len(self.particles)))

    def has_failed(self, stamp: int, trial_seconds: float) -> bool:
        """Whether it has had its trial, and is more probably wrong than right."""
        return (stamp - self._stamp) * 1e-9 >= trial_seconds and self.judge.probability_lost >= 0.5
