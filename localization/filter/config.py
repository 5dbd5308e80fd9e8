"""The settings of the particle filter."""

import math

from pydantic import Field

from racecar.localization.odometry.config import SlipConfig
from racecar.maps.settings import Settings


class ClusterConfig(Settings):
    """Which particles belong together, so that the pose is that of one place and not a mean of several."""

    place_size: float = Field(
        0.5,
        ge=0.05,
        le=100,
        description="metres: side of the squares that are compared for the heaviest place; by judgement",
    )
    radius: float = Field(
        1.0,
        ge=0.1,
        le=100,
        description="metres about the heaviest place within which particles belong to its cluster: farther "
        "than any tracked cloud reaches; by judgement",
    )
    half_angle: float = Field(
        1.0, ge=0.05, le=math.pi, description="radians about it, likewise; by judgement"
    )


class ParticleFilterConfig(Settings):
    """How much scans count, how particles are injected and resampled."""

    evidence_per_travel: float = Field(
        40.0,
        gt=0,
        le=10000,
        description="log-likelihood by which one scan counts against a particle at most, per metre plus "
        "radian since the last: what the map has wrong disturbs scans taken near each other alike; tried on "
        "the drives of `racecar benchmark accuracy`",
    )
    least_evidence: float = Field(
        2.0, gt=0, le=1000, description="log-likelihood: the bound is not lower, however short the travel"
    )
    most_evidence: float = Field(
        6.0,
        gt=0,
        le=1000,
        description="log-likelihood: the bound is not higher, because no single scan may rule a particle out",
    )
    injection_interval: int = Field(
        20,
        ge=2,
        le=10000,
        description="one particle in so many is injected where all of the odometry is wrong; without that "
        "fr079, whose odometry counts reversing as driving forward, was lost for minutes",
    )
    resample_below: float = Field(
        0.5,
        gt=0,
        le=1,
        description="share of effective particles below which all are drawn anew, as usual",
    )
    slips: SlipConfig = SlipConfig()
    clusters: ClusterConfig = ClusterConfig()
