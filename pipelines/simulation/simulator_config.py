"""Settings of a simulated drive, from which the commands derive their flags."""

from enum import Enum

from pydantic import Field

from racecar.maps.settings import Settings


class NoiseLevel(str, Enum):
    """Quality of the wheel odometry: exact, that of a well-kept car, or errors of some per cent with slip."""

    NONE = "none"
    SLIGHT = "slight"
    FULL = "full"


class LaserKind(str, Enum):
    """The laser of the car."""

    RACE = "race"
    SHORT = "short"
    ROUND = "round"
    OUTDOOR = "outdoor"


class DrivingConditions(Settings):
    """Settings that can be changed before or during a drive."""

    noise: NoiseLevel = Field(
        NoiseLevel.SLIGHT, description="Noise of the wheel odometry: none, slight or full."
    )
    max_speed: float = Field(2.0, ge=0.3, le=15.0, description="Top speed in m/s; bends are slower.")
    walkers: int = Field(0, ge=0, le=100, description="Number of people walking about.")
    slip: float = Field(
        0.0,
        ge=0.0,
        le=0.99,
        description="Wheel slip at full acceleration, a share: by so much wheels run ahead, and turns are "
        "overstated at the tyres' limit, on top of the noise.",
    )


class SimulationConfig(DrivingConditions):
    """A drive, the car's sensors, and the people around."""

    laser: LaserKind = Field(
        LaserKind.RACE,
        description="race: 270°, 30 m, 40 Hz; short: 240°, 4 m, 10 Hz, half of the beams empty; round: 360°, "
        "12 m, 7 Hz; outdoor: 180°, 80 m, 10 Hz, most distant returns missed.",
    )
    seed: int = Field(0, ge=0, description="Same seed, same result.")
    duration: float | None = Field(
        None,
        ge=0.5,
        le=100_000.0,
        description="How many seconds to drive; by default until the whole map is seen, or for two laps of a "
        "track.",
    )
    laps: int = Field(2, ge=1, description="How often to go round a circuit, unless a duration is given.")
    start: tuple[float, float, float] | None = Field(
        None, description="Pose in the map to start near; by default near the map's origin."
    )
    tilt: float = Field(
        0.0, ge=-10.0, le=10.0, description="Degrees by which the laser looks down, which no transform tells."
    )
    hills: float = Field(0.0, ge=0.0, le=0.3, description="Steepest slope, such as 0.06.")
    kerbs: float = Field(0.0, ge=0.0, le=1.0, description="Height of the campus' lawn in metres.")
    posts: int = Field(0, ge=0, le=12, description="Number of the robot's own posts in the laser's view.")
    carried: float = Field(
        0.0,
        ge=0.0,
        le=30.0,
        description="For so many seconds in each 30 the car is carried, its wheels standing.",
    )
    carrier: bool = Field(False, description="The laser sees the body of whoever carries the car.")
    follower: bool = Field(False, description="A person walks 2 to 3 m behind the car.")
    steering: bool = Field(False, description="Odometry turns by the steering angle, which is a little off.")
    scan_every: float = Field(0.0, ge=0.0, le=60.0, description="Keep only one scan in so many seconds.")
    scan_gaps: float = Field(
        0.0, ge=0.0, le=14.0, description="Keep no scans for so many seconds in each 15."
    )
    imu_rate: float = Field(
        0.0, ge=0.0, le=1000.0, description="Rate in Hz of /imu, a cheap gyroscope; by default there is none."
    )
    range_noise: float | None = Field(
        None, ge=0.0, description="Standard deviation of ranges in metres; by default as the laser has it."
    )
    dropouts: float | None = Field(
        None, ge=0.0, le=1.0, description="Share of beams that come back empty; by default the laser's."
    )
