"""What can be chosen about a simulated drive."""

from enum import Enum

from pydantic import BaseModel, ConfigDict, Field


class NoiseLevel(str, Enum):
    """How bad the wheel odometry is."""

    NONE = "none"
    SLIGHT = "slight"
    FULL = "full"


class LaserKind(str, Enum):
    """Which laser the car bears."""

    RACE = "race"
    SHORT = "short"
    ROUND = "round"
    OUTDOOR = "outdoor"


class SimulationConfig(BaseModel):
    """A drive, its car's sensors, and who walks about meanwhile."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    noise: NoiseLevel = NoiseLevel.SLIGHT
    """Of the wheel odometry: none (exact), slight (a well kept car), full (per cents of error, and slip)."""
    seed: int = Field(0, ge=0)
    duration: float | None = Field(None, gt=0.0)
    """Seconds; None: until the map is covered and the car is home again."""
    laps: int = Field(2, ge=1)
    """How often the car goes round where the map is a circuit, unless a duration is given."""
    max_speed: float = Field(2.0, gt=0.0, le=15.0)
    """m/s."""
    start: tuple[float, float, float] | None = None
    """Pose in the map to start near; None: near the map's origin."""
    walkers: int = Field(0, ge=0, le=100)
    """Number of people walking about."""
    slip: float = Field(0.0, ge=0.0, lt=1.0)
    """Share by which the wheels run ahead at full acceleration and turns are overstated at the tyres' limit,
    on top of what the noise level brings."""
    imu_rate: float = Field(0.0, ge=0.0, le=1000.0)
    """Readings of a gyroscope per second; 0: the car has none."""
    laser: LaserKind = LaserKind.RACE
    """Race (270°, 30 m, 40 Hz), short (240°, 4 m, half of the beams empty), round (360°, 12 m, 7 Hz) or
    outdoor (180°, 80 m, of which the far is mostly missed)."""
    tilt: float = Field(0.0, ge=-10.0, le=10.0)
    """Degrees by which the laser looks down, which no transform tells."""
    hills: float = Field(0.0, ge=0.0, le=0.3)
    """Steepest grade of the ground; 0: it is flat."""
    kerbs: float = Field(0.0, ge=0.0, le=1.0)
    """Metres by which the lawn beside the ways lies higher, on maps that have one."""
    posts: int = Field(0, ge=0, le=12)
    """Of the robot's own, in the laser's view."""
    carried: float = Field(0.0, ge=0.0, le=30.0)
    """Seconds of each 30 in which the car is carried along its path, its wheels standing."""
    carrier: bool = False
    """Whether the laser sees the body of who carries the car, meanwhile."""
    follower: bool = False
    """Whether a person walks 2 to 3 m behind the car."""
    steering: bool = False
    """Whether odometry turns by the steering angle, which is off by a constant and by a share."""
    scan_every: float = Field(0.0, ge=0.0)
    """Seconds per scan that the logger keeps at most; 0: it keeps all."""
    scan_gaps: float = Field(0.0, ge=0.0, lt=15.0)
    """Seconds of each 15 in which it keeps none."""
    range_noise: float | None = Field(None, ge=0.0)
    """Standard deviation in metres; None: as the laser has it."""
    dropouts: float | None = Field(None, ge=0.0, le=1.0)
    """Share of beams that come back empty; None: as the laser has it."""
