"""The settings of the sensors: what of their readings counts."""

from pydantic import Field, model_validator

from racecar.maps.settings import Settings


class SensorConfig(Settings):
    """What of a sensor's readings counts, in bags and live; the defaults are for planar lasers, and for 3D
    LiDARs on robots that are up to a metre tall."""

    min_height: float = Field(
        default=0.1,
        ge=-100.0,
        le=100.0,
        description="Metres above the base frame, from which on points of a 3D LiDAR make the planar scan; "
        "of a planar sensor all do. By judgement: above the floor.",
    )
    max_height: float = Field(
        default=1.0,
        ge=-100.0,
        le=100.0,
        description="The same, up to which they do. By judgement: below what a small robot drives under.",
    )
    min_range: float | None = Field(
        default=None,
        gt=0.0,
        lt=100.0,
        description="Metres; what is nearer is no reading, such as the robot's own body. null: as the scans "
        "state it (range_min), and 0.05 of point clouds.",
    )
    max_range: float | None = Field(
        default=None,
        gt=0.0,
        le=1000.0,
        description="Metres; what is farther is a miss, since the sensor sees nothing there. null: as the "
        "scans state it (range_max), and 100 of point clouds.",
    )

    @model_validator(mode="after")
    def _in_order(self) -> "SensorConfig":
        for kind in ("height", "range"):
            least, most = getattr(self, f"min_{kind}"), getattr(self, f"max_{kind}")
            if least is not None and most is not None and least >= most:
                raise ValueError(f"min_{kind} ({least:g}) should be below max_{kind} ({most:g})")
        return self
