"""Settings of the occupancy grid."""

from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    Field,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from racecar.maps.settings import Settings


def _rising(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """Validate that the second half is above the first, element by element; raises ValueError."""
    half = len(numbers) // 2
    if any(low >= high for low, high in zip(numbers[:half], numbers[half:], strict=True)):
        raise ValueError("not in order")
    return numbers


_Metres = Annotated[float, Field(ge=-1e7, le=1e7)]
"""Bounded by a quarter of the earth's circumference, since no map is larger."""
_Box = Annotated[tuple[_Metres, _Metres, _Metres, _Metres], AfterValidator(_rising)]
"""Smallest x, smallest y, largest x, largest y by definition."""
_Span = Annotated[tuple[Annotated[float, Field(ge=0.0)], float], AfterValidator(_rising)]
"""Start and end in seconds by definition."""
_EXPECTED = {
    "turn": "it should be radians, at most a whole turn, or walls",
    "crop": "it should be a box, the least x, least y, largest x and largest y in metres, or driven",
    "origin": "it should be x and y in metres, or corner",
    "left_out": "it should be spans of two seconds each, the earlier first",
}
"""Accepted values of union settings, as a clause, because pydantic has a line for each member."""


class RenderingConfig(Settings):
    """What a scan says about the cells along its rays; which part of the map is drawn, in which frame, and as
    what kind of image.

    The map is rotated, then cropped, then shifted to its origin: ``crop`` and ``origin`` are coordinates of
    the rotated map. If a map is extended, its frame stays: ``turn`` and ``origin`` are for the first drive,
    or for rendering it again.
    """

    hit_probability: float = Field(
        default=0.75,
        gt=0.5,
        lt=1.0,
        description="Probability that a cell is occupied, from one scan that ends in it. By judgement.",
    )
    pass_probability: float = Field(
        default=0.40,
        gt=0.0,
        lt=0.5,
        description="The same from one scan that passes it. By judgement: three passes outweigh a hit.",
    )
    longest_ray: float = Field(
        default=60.0,
        gt=0.0,
        le=60.0,
        description="Metres beyond which returns are left out, so that a stray one does not blow up the "
        "map. By judgement; at most 60, because rays are stored as 16-bit steps of 2 mm.",
    )
    margin: float = Field(
        default=1.0, ge=0.0, le=100.0, description="Metres of unknown cells around the map. For looks."
    )
    largest_speck: float = Field(
        default=0.6,
        ge=0.0,
        le=10.0,
        description="Metres of the longer side of a blob up to which it is left unknown where few keyframes "
        "saw it; 0 leaves all. By judgement: a walking person's.",
    )
    turn: Annotated[float, Field(ge=-6.3, le=6.3)] | Literal["walls"] = Field(
        default=0.0,
        description="Radians by which the map is turned, counter-clockwise; or `walls`: the least turn that "
        "lays the main walls along the axes.",
    )
    crop: _Box | Literal["driven"] | None = Field(
        default=None,
        description="What is drawn: a box of least x, least y, largest x and largest y in metres; or "
        "`driven`: what lies within `driven_margin` of the path; or all.",
    )
    driven_margin: float = Field(
        default=2.0,
        gt=0.0,
        le=1000.0,
        description="Metres around the path that count as driven. By judgement: the width of a corridor.",
    )
    origin: tuple[_Metres, _Metres] | Literal["corner"] | None = Field(
        default=None,
        description="The place, x and y in metres, that becomes (0, 0); or `corner`: the lower left of the "
        "image; or it stays where the first drive began.",
    )
    left_out: tuple[_Span, ...] = Field(
        default=(),
        description="Spans of time, in seconds since the first scan, whose scans draw nothing; they still "
        "tell where the car was.",
    )
    mode: Literal["trinary", "scale", "raw"] = Field(
        default="trinary",
        description="What the pixels of the image mean, in map_server's terms: occupied, free or unknown; "
        "graded between free and occupied, as PNG, since unknown is transparent; or percent as they are.",
    )
    occupied_threshold: float = Field(
        default=0.65,
        gt=0.0,
        le=1.0,
        description="Probability from which a cell is written as occupied; `raw` images have all "
        "probabilities. map_server's default.",
    )
    free_threshold: float = Field(
        default=0.196,
        ge=0.0,
        lt=1.0,
        description="Probability up to which a cell is written as free. map_server's default.",
    )

    @field_validator("turn", "crop", "origin", "left_out", mode="wrap")
    @classmethod
    def _say_what_is_expected(
        cls, value: object, validate: ValidatorFunctionWrapHandler, info: ValidationInfo
    ) -> object:
        """Replace pydantic's message by that of `_EXPECTED`; raises ValueError."""
        try:
            valid: object = validate(value)
        except ValidationError as error:
            raise ValueError(_EXPECTED[str(info.field_name)]) from error
        return valid

    @model_validator(mode="after")
    def _check_order(self) -> "RenderingConfig":
        if self.free_threshold >= self.occupied_threshold:
            raise ValueError("free_threshold should be below occupied_threshold")
        return self
