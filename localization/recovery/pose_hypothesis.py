"""A hypothesis of where the car is: weighed, estimated and judged by itself."""

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.recovery.lost_detector import LostDetector
from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.beams import Beams


class PoseHypothesis:
    """A cloud of particles, and the odds that the car is elsewhere."""

    def __init__(self, particles: ParticleFilter, lost: LostDetector, stamp: int) -> None:
        """The stamp (nanoseconds) is when the place was found; the detector judges that place."""
        self.particles = particles
        self.lost = lost
        self.is_known = False
        """Whether the cloud lies at one place."""
        self._stamp = stamp

    def weigh(self, beams: Beams, travel: float, perception: Perception) -> None:
        """Take in a scan so many metres plus radians after the last.

        While the place is known, only what the map explains counts, and where beams fit better beside it, a
        few particles go there.
        """
        evidence = 1.0
        if self.is_known:
            explained = perception.explanation(self.particles, beams)
            beams, evidence = explained.beams, explained.evidence
            if explained.better is not None:
                self.particles.propose(*explained.better)
        log_likelihood = perception.log_likelihood(self.particles.map_from_base, beams)
        self.particles.weigh_next(evidence * log_likelihood, travel)

    def estimate(
        self, beams: Beams, stamp: int, seconds: float, is_start: bool, perception: Perception
    ) -> PoseEstimate:
        """The pose by all scans so far, judged by how this one agrees, so many seconds after the last."""
        map_from_base, covariance, weight = self.particles.moments()
        tracking = perception.config.tracking
        variance = float(covariance[0, 0] + covariance[1, 1])
        self.is_known = weight > tracking.dominant and variance < tracking.known_within**2
        if self.is_known:
            map_from_base, covariance = perception.aligned(map_from_base, covariance, beams)
        agreement = perception.agreement(map_from_base, beams)
        if agreement is not None:
            self.lost.judge(agreement.shares, seconds)
        return PoseEstimate(
            stamp=stamp,
            map_from_base=map_from_base,
            covariance=covariance,
            cluster_weight=weight,
            effective_sample_size=self.particles.effective_size,
            particle_count=len(self.particles),
            is_start=is_start,
            lost_probability=1.0 - (1.0 - self.lost.probability) * weight,
            agreement=None if agreement is None else agreement.telling,
        )

    def resample(self, config: LocalizationConfig) -> None:
        """Draw as many particles as the place needs."""
        if self.is_known:
            self.particles.resample(min(config.fewest_particles, config.particles))
        else:
            self.particles.resample(max(config.particles, len(self.particles)))

    def has_failed(self, stamp: int, trial_seconds: float) -> bool:
        """Whether it has had its trial, and is more probably wrong than right."""
        return (stamp - self._stamp) * 1e-9 >= trial_seconds and self.lost.probability >= 0.5
