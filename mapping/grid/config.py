"""Settings of the occupancy grid: how it is rendered, kept up to date during a drive, and despeckled."""

from pydantic import Field

from racecar.maps.settings import Settings


class RenderingConfig(Settings):
    """What a scan says about the cells along its rays."""

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
    growth: float = Field(
        default=10.0,
        ge=0.0,
        le=1000.0,
        description="Metres of spare room when the grid must grow. By judgement: copies become rare.",
    )


class DespecklingConfig(Settings):
    """Which small blobs become unknown."""

    max_size: float = Field(
        default=0.6,
        gt=0.0,
        le=100.0,
        description="Metres of a blob's longer side: a walking person's, by judgement.",
    )
    min_keyframes: int = Field(
        default=8,
        ge=1,
        le=1000,
        description="Keyframes that must have seen a blob for it to stay. By judgement: 2 m of path and "
        "more; pytest tests/simulated/test_hard_places.py checks it with simulated people.",
    )
