"""The settings of how the car's motion is measured, and of what is learned about its odometry."""

from pydantic import Field, model_validator

from racecar.maps.settings import Settings


class MotionConfig(Settings):
    """How the motion between two scans is found, also where odometry is late or silent."""

    restart_seconds: float = Field(
        1.0,
        gt=0,
        le=100,
        description="seconds by which a clock must go back to count as set anew; by less, messages came out "
        "of order; by judgement",
    )
    gap_seconds: float = Field(
        2.0,
        gt=0,
        le=1000,
        description="seconds between two scans; after a longer gap the car is searched for, because it may "
        "have been carried anywhere; by judgement",
    )
    longest_extrapolation: float = Field(
        0.1,
        ge=0,
        le=10,
        description="seconds past the latest odometry for which its speed is taken to last: a few periods "
        "of usual odometry (50 Hz); by judgement",
    )
    longest_carry: float = Field(
        0.5,
        gt=0,
        le=100,
        description="seconds for which the speed of the estimates is taken to last where there is no "
        "odometry: a car can stop within half a second; by judgement",
    )
    speed_seconds: float = Field(
        0.15,
        gt=0,
        le=100,
        description="seconds over which the speed of the estimates is averaged, some scans of a common "
        "sensor (40 Hz); by judgement",
    )


class SpeedMemoryConfig(Settings):
    """How speeds of a moment ago bear on a measured step: cars slide on, and follow their odometry late."""

    slide_seconds: float = Field(
        0.2,
        gt=0,
        le=100,
        description="seconds after which a third of the noise of a motion is left: with its wheels locked a "
        "car slides on; by judgement",
    )
    standing_speed: float = Field(
        0.01,
        ge=0,
        le=1,
        description="metres or radians per second below which the car stands: what a log's last digits make "
        "up; by judgement",
    )
    smooth_seconds: float = Field(
        0.15,
        gt=0,
        le=100,
        description="seconds over which the speed is averaged that the force on the tyres is taken from, "
        "since differences of raw speeds are mostly noise; by judgement",
    )
    lag_seconds: float = Field(
        0.1,
        gt=0,
        le=10,
        description="seconds, the time constant by which a car follows odometry made of the commands to "
        "motor and servo; measured by laying odometry beside matched scans: on session_A and "
        "localization_bag1 turns and distances are 0.1 s early",
    )
    grip: float = Field(
        4.0,
        gt=0,
        le=1000,
        description="metres per second squared at which tyres slip as much as they ever do: the friction of "
        "rubber on a smooth floor is about 0.4 g; by judgement",
    )


class SlipConfig(Settings):
    """How the particles' guesses of slip and lag are spread, and how long they last."""

    usual_share: float = Field(
        0.05,
        ge=0,
        le=10,
        description="standard deviation of the share by which odometry is wrong even when nothing pushes the "
        "tyres; session_A's distances are 2 to 5 % off",
    )
    lag_deviation: float = Field(
        0.7,
        ge=0,
        le=100,
        description="standard deviation of the car's lag, in units of that by which a car lags that follows "
        "with 'lag_seconds'; two recorded race cars had 1.6",
    )
    distance_seconds: float = Field(
        10.0, gt=0, le=1000, description="seconds for which the share of the distance lasts; by judgement"
    )
    turn_seconds: float = Field(
        10.0, gt=0, le=1000, description="seconds for which the share of the turn lasts; by judgement"
    )
    lag_seconds: float = Field(
        30.0,
        gt=0,
        le=10000,
        description="seconds for which the lag lasts: it belongs to the car, not to the floor; by judgement",
    )
    pushed_seconds: float = Field(
        0.5,
        gt=0,
        le=100,
        description="seconds for which slips last at full effort, about as long as a bend or a braking; by "
        "judgement",
    )
    change_after: float = Field(
        0.1,
        gt=0,
        le=10,
        description="seconds between changes of the slips: short beside all times above, and it saves a loop "
        "over the particles in most steps",
    )


class SegmentConfig(Settings):
    """How the path is divided to compare odometry with the estimates."""

    shortest: float = Field(
        1.0,
        gt=0,
        le=100,
        description="metres plus radians of a segment at least, so that what odometry gets wrong exceeds the "
        "centimetres by which estimates are off",
    )
    longest: float = Field(
        3.0,
        gt=0,
        le=1000,
        description="metres plus radians of a segment at most; over longer ones errors are no longer linear; "
        "by judgement",
    )

    @model_validator(mode="after")
    def _in_order(self) -> "SegmentConfig":
        if self.shortest > self.longest:
            raise ValueError("shortest must not exceed longest")
        return self


class OdometryTrustConfig(Settings):
    """How this car's slip scale is learned; tried on the drives of ``racecar benchmark accuracy``."""

    memory: float = Field(
        30.0,
        gt=0,
        le=10000,
        description="metres plus radians after which what was seen counts a third; by judgement",
    )
    prior_weight: float = Field(
        0.05,
        gt=0,
        le=10,
        description="squared metres: the slip in the settings counts like a segment whose odometry could "
        "have been off by so much (squared); by judgement",
    )
    usual_effort: float = Field(
        0.3,
        ge=0,
        le=1,
        description="share of the full effort that accounts for what odometry gets wrong without any; by "
        "judgement",
    )
    worst: float = Field(
        2.0,
        gt=0,
        le=1000,
        description="a segment counts as off by at most so many times the slip in the settings, or else one "
        "bump would be held against odometry for long; by judgement",
    )


class OdometryCalibrationConfig(Settings):
    """What is expected of the constant faults of odometry before any was seen, and how they are learned."""

    distance_deviation: float = Field(
        0.05,
        gt=0,
        le=10,
        description="standard deviation of the share by which cars' distances are off; recorded cars: 5 %. "
        "With 0.1, estimates that wander along a bare corridor made wheels out that tell twice the distance",
    )
    turn_deviation: float = Field(
        0.1, gt=0, le=10, description="the same of turns; the logs of the SLAM benchmark: 2 to 5 %"
    )
    trim_deviation: float = Field(
        0.05,
        gt=0,
        le=10,
        description="radians per metre by which cars turn where odometry says straight ahead; up to 0.06 on "
        "the logs of the SLAM benchmark",
    )
    memory: float = Field(
        200.0,
        gt=0,
        le=100000,
        description="metres plus radians after which a third is left of what was learned; by judgement",
    )
    unexplained: float = Field(
        0.05,
        gt=0,
        le=10,
        description="share of distance and turn by which a segment is off for reasons of its own, besides "
        "slipping tyres; by judgement",
    )
    farthest: float = Field(
        16.0,
        gt=0,
        le=10000,
        description="squared Mahalanobis distance beyond which a segment is left out, as after a bump: four "
        "standard deviations",
    )
