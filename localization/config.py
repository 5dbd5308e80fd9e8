"""The settings of localization."""

from typing import Literal

from pydantic import Field

from racecar.maps.settings import Settings


class LocalizationConfig(Settings):
    """Settings of the particle filter; the defaults serve every car and map we have recordings of."""

    particles: int = Field(4000, ge=10, le=1_000_000, description="most particles while tracking")
    fewest_particles: int = Field(
        1000, ge=10, le=1_000_000, description="particles while a narrow cloud needs no more of them"
    )
    scattered_particles: int = Field(
        20_000, ge=10, le=1_000_000, description="particles while it is not yet known where the car is"
    )
    beams: int = Field(100, ge=1, le=10_000, description="beams weighed per scan, evenly taken over it")
    motion_model: Literal["odometry", "ackermann"] = Field(
        "odometry", description="what errs: the measured increment, or the speed and the steering behind it"
    )
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
    wheelbase: float = Field(0.33, gt=0, le=10, description="metres between the axles, for 'ackermann'")
    slip: float = Field(
        0.3,
        ge=0,
        le=2,
        description="standard deviation of the share by which wheels and steering deceive, until they "
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
    sensor_model: Literal["beam", "likelihood_field"] = Field(
        "beam", description="a reading beside the range the map says, or how far its end is from a wall"
    )
    squash: float = Field(
        2.2, ge=1, description="a scan's probability is raised to 1/squash: its beams are not independent"
    )
    table_megabytes: int = Field(
        256, ge=1, description="limit of the range table; a larger map gets coarser headings"
    )
