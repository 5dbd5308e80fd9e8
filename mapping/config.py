"""Settings of the mapper; the defaults serve every sensor we have recordings of."""

from pydantic import Field

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.quality.config import QualityConfig
from racecar.maps.settings import Settings


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
    rendering: RenderingConfig = RenderingConfig()
    quality: QualityConfig = QualityConfig()
