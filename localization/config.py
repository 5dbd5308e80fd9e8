"""The settings of localization."""

from pydantic import BaseModel, ConfigDict, Field


class LocalizationConfig(BaseModel):
    """Settings of the particle filter; the defaults serve every car and map we have recordings of."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    particles: int = Field(4000, ge=10, le=1_000_000, description="particles while tracking")
    scattered_particles: int = Field(
        20_000, ge=10, le=1_000_000, description="particles while it is not yet known where the car is"
    )
    beams: int = Field(100, ge=1, le=10_000, description="beams weighed per scan, evenly taken over it")
    motion_noise: float = Field(
        0.02, gt=0, le=1, description="standard deviation (m, rad) after a metre or radian of odometry"
    )
    slip: float = Field(
        0.3, ge=0, le=2, description="standard deviation of the share by which wheels and steering deceive"
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
    squash: float = Field(
        2.2, ge=1, description="a scan's probability is raised to 1/squash: its beams are not independent"
    )
    table_megabytes: int = Field(
        256, ge=1, description="limit of the range table; a larger map gets coarser headings"
    )
