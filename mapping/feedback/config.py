"""Settings of the feedback of the verdict into the map."""

from pydantic import Field

from racecar.mapping.loops.config import (
    ConsistentSupportConfig,
    LoopClosureConfig,
    SeeThroughVerificationConfig,
    SubmapSearchConfig,
)
from racecar.maps.settings import Settings

_LOOPS = LoopClosureConfig(
    search=SubmapSearchConfig(min_score=0.25),
    see_through=SeeThroughVerificationConfig(min_coverage=0.25),
    consistent_support=ConsistentSupportConfig(reach_per_supporter=1e3),
)
"""About half the score and coverage that the drive asks for, because passes often have little in common
where a loop was missed, and one supporter however wide the window. Measured on a lab seen by a laser of 4 m
and on a piece of intel with a hole: the drive's own limits find none of the loops that these find."""


class FeedbackConfig(Settings):
    """How loops are sought that a drive missed."""

    rounds: int = Field(
        default=3,
        ge=0,
        le=100,
        description="How often a map is corrected and judged again at most, for the time it takes. By "
        "judgement.",
    )
    reach: float = Field(
        default=3.0,
        gt=0.0,
        le=100.0,
        description="Metres to each side within which a pass is searched for on one that contradicts it. "
        "By judgement: passes are compared where they lie within 4 m of each other.",
    )
    turn: float = Field(
        default=0.5,
        gt=0.0,
        le=4.0,
        description="Radians likewise. Measured on a lab seen by a laser of 4 m: 0.3 after 22 m of path.",
    )
    sought_at: tuple[float, ...] = Field(
        default=(-1.5, 0.0, 1.5),
        description="Metres of path from the middle of a pass to the places from which it is searched for, "
        "so that they can support each other. By judgement.",
    )
    loops: LoopClosureConfig = Field(
        default=_LOOPS,
        description="How passes are searched for on each other: more leniently than during the drive, "
        "because the map that a wrong loop leads to refutes it.",
    )
