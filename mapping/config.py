"""The settings of the mapper; the defaults serve every sensor we have recordings of."""

from pydantic import Field

from racecar.mapping.grid.config import DespecklingConfig, GrowingGridConfig, RenderingConfig
from racecar.mapping.keyframes.config import KeyframeConfig
from racecar.mapping.loops.config import LoopClosureConfig
from racecar.mapping.matching.config import ScanMatchingConfig
from racecar.mapping.moving_along.config import MovingAlongConfig
from racecar.mapping.odometry.config import DeadReckoningConfig
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.self_calibration.config import SelfCalibrationConfig
from racecar.mapping.session.config import PlaceRecognitionConfig
from racecar.maps.settings import Settings


class ScheduleConfig(Settings):
    """How often the mapper does what it does not do at each keyframe; all counts are of keyframes."""

    window: int = Field(
        default=40,
        ge=2,
        le=10_000,
        description="The latest keyframes, that are optimized while the drive goes on. By judgement: a "
        "little over the farthest that one is tied to.",
    )
    window_interval: int = Field(
        default=10,
        ge=1,
        le=10_000,
        description="After how many keyframes they are optimized, and scans are trimmed. By judgement.",
    )
    final_rounds: int = Field(
        default=10,
        ge=1,
        le=100,
        description="How often, at most, the whole drive is matched again at the end. By judgement: on "
        "simulated open ground, where few scans show how far the wheels drove, the path is settled by then.",
    )
    settled_bend: float = Field(
        default=0.015,
        gt=0.0,
        le=10.0,
        description="Metres by which, on average, one more round shifts the farthest keyframe that each is "
        "tied to, below which the path is settled. Measured: 0.006 m after the first round on aces, 0.01 to "
        "0.9 m on simulated open ground.",
    )
    recent_loops: int = Field(
        default=10,
        ge=0,
        le=1000,
        description="Loops closed since a keyframe, after which it is held where it is when the next loop "
        "strains the map. By judgement: so a loop costs the same all day.",
    )
    lag_interval: int = Field(
        default=10,
        ge=1,
        le=10_000,
        description="After how many keyframes the lag of the wheels' clock is learned. By judgement.",
    )
    calibration_interval: int = Field(
        default=50,
        ge=1,
        le=10_000,
        description="After how many keyframes the wheels are calibrated anew, and after fewer where these "
        "lie farther apart than they need to. By judgement: some 15 m of path. Where a scan came once in 2 s "
        "and this was 100 m, wheels that had been right to 1 cm for 80 m were overruled by a corridor that "
        "looks like another, and the map was off by 28 m.",
    )
    calibration_window: int = Field(
        default=1000,
        ge=1,
        le=100000,
        description="The latest keyframe steps by which they are calibrated. By judgement: some 300 m of "
        "path, at a cost that does not grow.",
    )
    checkpoint_interval: int = Field(
        default=100,
        ge=1,
        le=100_000,
        description="After how many keyframes the mapper may be saved, keyframes are trimmed and what "
        "cannot be saved is forgotten. By judgement: some seconds of work that is lost with a run that is "
        "killed.",
    )

    def calibrates_at(self, index: int, stretch: float) -> bool:
        """Whether the wheels are calibrated at a keyframe, that lies ``stretch`` times as far from the one
        before as keyframes need to."""
        return index % max(round(self.calibration_interval / max(stretch, 1.0)), 1) == 0


class MappingConfig(Settings):
    """Settings of one mapping run."""

    resolution: float = Field(
        default=0.05,
        ge=0.005,
        le=1.0,
        description="Side of a map cell, metres. A usual choice; finer than 1 cm no common laser measures.",
    )
    keyframe_distance: float = Field(
        default=0.3, gt=0.0, le=5.0, description="A new keyframe is due after this many metres."
    )
    keyframe_angle: float = Field(
        default=0.2, gt=0.0, le=3.0, description="A new keyframe is due after this turn, radians."
    )
    refine: bool = Field(
        default=True, description="Match every scan to the keyframes around it once these are optimized."
    )
    close_loops: bool = Field(default=True, description="Recognize places that the car has been to before.")
    verify_loops: bool = Field(
        default=True,
        description="Test loop closures by what scans look through, and by their neighbours.",
    )
    self_calibration: SelfCalibrationConfig = SelfCalibrationConfig()
    moving_along: MovingAlongConfig = MovingAlongConfig()
    odometry: DeadReckoningConfig = DeadReckoningConfig()
    matching: ScanMatchingConfig = ScanMatchingConfig()
    keyframes: KeyframeConfig = KeyframeConfig()
    schedule: ScheduleConfig = ScheduleConfig()
    loops: LoopClosureConfig = LoopClosureConfig()
    rendering: RenderingConfig = RenderingConfig()
    despeckling: DespecklingConfig = DespecklingConfig()
    growing_grid: GrowingGridConfig = GrowingGridConfig()
    place_recognition: PlaceRecognitionConfig = PlaceRecognitionConfig()
    quality: QualityConfig = QualityConfig()
