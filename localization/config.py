"""Settings of localization."""

from pydantic import Field

from racecar.maps.settings import Settings


class LocalizationConfig(Settings):
    """Settings of the particle filter; the defaults serve every car and map we have recordings of."""

    particles: int = Field(4000, ge=10, le=1_000_000, description="most particles while tracking")
    fewest_particles: int = Field(
        1000, ge=10, le=1_000_000, description="particles while the cloud is narrow"
    )
    scattered_particles: int = Field(
        20_000, ge=10, le=1_000_000, description="particles of which a search of the map chooses"
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
        0.5, gt=0, le=10, description="standard deviation in metres about an initial pose that was given"
    )
    start_heading_spread: float = Field(
        0.25, gt=0, le=3.2, description="standard deviation in radians about a start heading that was given"
    )
