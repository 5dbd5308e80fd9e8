"""Settings of what sensors have in common."""

from pydantic import Field

from racecar.maps.settings import Settings


class TurnFusionConfig(Settings):
    """How the turns of wheels and gyroscope are compared with those that the scans show, and fused."""

    segment_seconds: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Seconds of drive, at least, over which turns are compared: over much less the jitter of "
        "single scans hides what is compared. By judgement.",
    )
    segments: int = Field(
        default=300,
        ge=10,
        le=100_000,
        description="Segments that are remembered: some minutes of driving, over which a bias stays what it "
        "is. By judgement.",
    )
    memory: float = Field(
        default=150.0,
        gt=0.0,
        le=100_000.0,
        description="Segments after which one counts a third, since the bias drifts as the chip warms. By "
        "judgement.",
    )
    scan_noise: float = Field(
        default=0.005,
        gt=0.0,
        le=1.0,
        description="Standard deviation, in radians, of a turn that scans show, as two matched headings "
        "have it: 0.2° each, which laser scans of a room reach. By judgement.",
    )
    bias_sigma: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Standard deviation of a gyroscope's bias, rad/s, before it is learned: 6 °/s; the data "
        "sheet of the MPU-6050 allows 20 °/s, most are far below.",
    )
    scale_sigma: float = Field(
        default=0.3,
        gt=0.0,
        le=10.0,
        description="Standard deviation of a gyroscope's scale before it is learned, so wide that degrees "
        "and a wrong sign show as such: by judgement.",
    )
    known_scale: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="Largest standard deviation of the scale with which a gyroscope that was tried is "
        "believed: one that stays at rest while the car turns leaves it unknown. By judgement.",
    )
    unseen_turn: float = Field(
        default=0.2,
        gt=0.0,
        le=100.0,
        description="Radians, beyond what a bias makes, that the gyroscope must have turned while wheels "
        "that never reported the least turn reported none: then they do not know turns. By judgement.",
    )
    turn_until_tried: float = Field(
        default=2.0,
        gt=0.0,
        le=1000.0,
        description="Radians that the car must have turned, to and fro, until the gyroscope counts as tried. "
        "By judgement: a bend or two.",
    )
    max_scale_error: float = Field(
        default=0.15,
        gt=0.0,
        le=1.0,
        description="Share by which the scale may be off: more is no gyroscope of this car, or one in other "
        "units or about another axis. Data sheets allow 3 %; the rest is for turns that slow ones lose, by "
        "judgement.",
    )
    min_segments: int = Field(
        default=5,
        ge=3,
        le=1000,
        description="Segments until the gyroscope may count as tried, as a spread of fewer says little. By "
        "judgement.",
    )
    metre_exposure: float = Field(
        default=0.3,
        ge=0.0,
        le=100.0,
        description="Radians of turn that put wheels to as much of a test as a metre of driving. By "
        "judgement: calibrated wheels err by some per cent of a turn and by a degree in some metres.",
    )
    standing_exposure: float = Field(
        default=1e-6,
        gt=0.0,
        le=1.0,
        description="The same of a second in which the wheels stand: next to nothing, as a car that stands "
        "does not turn; wheels that stand while the car turns are found out by it at once. By judgement.",
    )
    second_exposure: float = Field(
        default=0.1,
        gt=0.0,
        le=100.0,
        description="Radians of turn that put a gyroscope to as much of a test as a second: it errs by per "
        "cents of a turn, and by what is left of its bias. By judgement.",
    )
    min_variance: float = Field(
        default=1e-6,
        gt=0.0,
        le=1.0,
        description="Least variance of a turn, square radians per radian of exposure, since no comparison "
        "shows less: 0.06° after a radian. By judgement.",
    )
