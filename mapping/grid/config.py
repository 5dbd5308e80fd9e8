"""Settings of the occupancy grid: how it is rendered, kept up to date during a drive, and despeckled."""

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
    """The same; ValueError unless each of the second half is above its like in the first."""
    half = len(numbers) // 2
    if any(low >= high for low, high in zip(numbers[:half], numbers[half:], strict=True)):
        raise ValueError("not in order")
    return numbers


_Metres = Annotated[float, Field(ge=-1e7, le=1e7)]
"""Within a quarter of the earth's circumference, since no map is larger."""
_Box = Annotated[tuple[_Metres, _Metres, _Metres, _Metres], AfterValidator(_rising)]
"""Least x, least y, largest x, largest y by definition."""
_Span = Annotated[tuple[Annotated[float, Field(ge=0.0)], float], AfterValidator(_rising)]
"""Seconds, the earlier first by definition."""
_EXPECTED = {
    "turn": "it should be radians, at most a whole turn, or walls",
    "crop": "it should be a box, the least x, least y, largest x and largest y in metres, or driven",
    "origin": "it should be x and y in metres, or corner",
    "left_out": "it should be spans of two seconds each, the earlier first",
}
"""What a setting of several kinds may be, in a clause, because pydantic has a line for each kind."""


class RenderingConfig(Settings):
    """What a scan says about the cells along its rays; which part of the map is drawn, in which frame, and as
    what kind of image.

    The map is turned, then cropped, then shifted to its origin: the numbers of ``crop`` and ``origin`` are of
    the map as it is turned. Where a map is carried on, its frame stays: ``turn`` and ``origin`` are for the
    first drive, or for rendering it again.
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
    settled_probability: float = Field(
        default=0.9,
        gt=0.8,
        lt=1.0,
        description="Probability, at most, of what earlier drives saw of a cell, occupied or free, so that a "
        "later drive that sees otherwise is soon believed. By judgement: ten passes free a cell, three hits "
        "occupy one.",
    )
    cleared_by_miss: float = Field(
        default=5.0,
        ge=0.0,
        le=60.0,
        description="Metres that a beam without a return shows to be free, no farther because it may have "
        "met glass or black paint. By judgement.",
    )
    narrowest_opening: float = Field(
        default=0.5,
        ge=0.0,
        le=100.0,
        description="Metres across the beams between two neighbouring returns; where they leave less room, "
        "misses between them clear no farther than the nearer of both. By judgement: less than any doorway. "
        "Measured in a simulated building, of a laser that loses half of its beams: 8 m² of false floor from "
        "0.25 to 1 m, 200 m² at 0.",
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
        """Raises ValueError with that."""
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


class GrowingGridConfig(Settings):
    """How the grid of a drive that goes on is kept up to date."""

    unsettled_keyframes: int = Field(
        default=80,
        ge=0,
        le=10000,
        description="The latest keyframes, which are drawn afresh each time. By judgement: twice the window "
        "of keyframes that the mapper keeps adjusting.",
    )
    max_shift: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Cells by which a settled keyframe, or what it sees at `sight`, may move before all is "
        "redrawn: half a cell, by rounding.",
    )
    sight: float = Field(
        default=10.0,
        ge=0.0,
        le=1000.0,
        description="Metres at which a turn of a keyframe is judged. By judgement: most of what indoor "
        "scans see.",
    )
    redrawn_at_once: int = Field(
        default=200,
        ge=1,
        le=100000,
        description="Keyframes redrawn in one call, so that the next map comes within a second or so. "
        "Measured with 2200 keyframes: drawn in one call, nothing was published for 3 to 4 s.",
    )


class DespecklingConfig(Settings):
    """Which small blobs become unknown."""

    max_size: float = Field(
        default=0.6,
        gt=0.0,
        le=10.0,
        description="Metres of a blob's longer side: a walking person's, by judgement.",
    )
    min_keyframes: int = Field(
        default=8,
        ge=1,
        le=1000,
        description="Keyframes that must have seen a blob for it to stay. By judgement: 2 m of path and "
        "more; pytest tests/simulated/test_hard_places.py checks it with simulated people.",
    )
