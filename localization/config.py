"""The settings of localization."""

from pydantic import Field

from racecar.localization.filter.config import ParticleFilterConfig
from racecar.localization.floor.config import FreeSpaceConfig
from racecar.localization.odometry.config import (
    MotionConfig,
    OdometryCalibrationConfig,
    OdometryTrustConfig,
    SegmentConfig,
    SpeedMemoryConfig,
)
from racecar.localization.recovery.config import HypothesisConfig, MovingRivalConfig
from racecar.localization.refinement.config import AlignmentConfig
from racecar.localization.verdict.config import VerdictConfig
from racecar.maps.sensing.config import TurnFusionConfig
from racecar.maps.settings import Settings


class TrackingConfig(Settings):
    """When scans count, when the pose counts as known, and when another place is considered."""

    news_after: float = Field(
        0.02,
        ge=0,
        le=10,
        description="metres plus radians of motion after which a scan counts: those of a car that stands "
        "repeat themselves, and counted as independent they would narrow the cloud to a point; by judgement",
    )
    look_again_after: float = Field(
        0.5,
        gt=0,
        le=100,
        description="seconds after which a scan counts although the wheels stand, since the car may be "
        "sliding or pushed; by judgement",
    )
    pushed_distance: float = Field(
        0.1,
        ge=0,
        le=10,
        description="metres by which a car whose wheels stand may have moved meanwhile, for a few particles; "
        "by judgement",
    )
    pushed_angle: float = Field(0.05, ge=0, le=10, description="radians, likewise; by judgement")
    dominant: float = Field(
        0.9,
        gt=0.5,
        le=1,
        description="weight of a cluster beside which the others do not matter; by judgement",
    )
    known_within: float = Field(
        0.25,
        gt=0,
        le=100,
        description="metres of standard deviation within which the place counts as known: beams that the map "
        "does not explain may be left out, the scan is laid on the walls, the fewest particles will do, and "
        "the place is held against the odometry; by judgement. Bounds of 0.5, 0.25 and 0.1 m for these did "
        "no better (`racecar benchmark accuracy --ablation`)",
    )
    first_scan_share: float = Field(
        0.25,
        gt=0,
        le=1,
        description="share of a first scan's log-likelihood that counts about a given pose: where the map "
        "has changed, another place fits better (up to 1.4 m away in tests), which only driving refutes",
    )
    first_scan_distance: float = Field(
        0.05,
        ge=0,
        le=10,
        description="metres by which the particles that a first scan leaves are spread, about the width of "
        "its likelihood, since they are copies of few (Musso, Oudjane and Le Gland: Improving regularised "
        "particle filters, 2001). Without that, a start whose laser is covered after a fifth of a second was "
        "carried on half a dozen times worse by odometry",
    )
    first_scan_angle: float = Field(0.02, ge=0, le=3.2, description="radians, likewise")


class LocalizationConfig(Settings):
    """Settings of the particle filter; the defaults serve every car and map we have recordings of."""

    particles: int = Field(4000, ge=10, le=1_000_000, description="most particles while tracking")
    fewest_particles: int = Field(
        1000, ge=10, le=1_000_000, description="particles while the cloud is narrow, see 'tracking'"
    )
    scattered_particles: int = Field(
        20_000, ge=10, le=1_000_000, description="particles while it is not yet known where the car is"
    )
    beams: int = Field(100, ge=1, le=10_000, description="beams weighed per scan, evenly taken over it")
    turn_noise_per_turn: float = Field(
        0.02,
        gt=0,
        le=1,
        description="Thrun's alpha 1: standard deviation of the heading (rad) after a turn of 1",
    )
    turn_noise_per_metre: float = Field(
        0.02, gt=0, le=1, description="alpha 2: standard deviation of the heading (rad) after a metre"
    )
    path_noise_per_metre: float = Field(
        0.02, gt=0, le=1, description="alpha 3: standard deviation of the place (m) after a metre"
    )
    path_noise_per_turn: float = Field(
        0.02, gt=0, le=1, description="alpha 4: standard deviation of the place (m) after a radian"
    )
    slip: float = Field(
        0.3,
        ge=0,
        le=2,
        description="standard deviation of the share by which wheels and steering are wrong, until they "
        "prove better; at 0 their timing is trusted, too",
    )
    drift_noise: float = Field(
        0.2, gt=0, le=10, description="standard deviation (m, rad) after a second without odometry"
    )
    start_spread: float = Field(
        0.5, gt=0, le=10, description="standard deviation in metres about a start pose that was given"
    )
    start_heading_spread: float = Field(
        0.25, gt=0, le=3.2, description="standard deviation in radians about a start heading that was given"
    )
    motion: MotionConfig = MotionConfig()
    speed_memory: SpeedMemoryConfig = SpeedMemoryConfig()
    odometry_segments: SegmentConfig = SegmentConfig()
    odometry_trust: OdometryTrustConfig = OdometryTrustConfig()
    odometry_calibration: OdometryCalibrationConfig = OdometryCalibrationConfig()
    turn_fusion: TurnFusionConfig = TurnFusionConfig()
    particle_filter: ParticleFilterConfig = ParticleFilterConfig()
    tracking: TrackingConfig = TrackingConfig()
    free_space: FreeSpaceConfig = FreeSpaceConfig()
    alignment: AlignmentConfig = AlignmentConfig()
    moving_rival: MovingRivalConfig = MovingRivalConfig()
    hypothesis: HypothesisConfig = HypothesisConfig()
    verdict: VerdictConfig = VerdictConfig()
