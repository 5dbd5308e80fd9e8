"""Settings of session merging."""

import math

from pydantic import Field

from racecar.maps.settings import Settings


class PlaceRecognitionConfig(Settings):
    """How a drive is recognized on an earlier map of which it has no pose."""

    place_spacing: float = Field(
        default=3.0,
        ge=0.0,
        le=1000.0,
        description="Metres between two submaps of the earlier map that are searched on. By judgement: less "
        "than the reach of the search, so that the windows overlap.",
    )
    place_turn: float = Field(
        default=math.radians(60.0),
        ge=0.0,
        le=1000.0,
        description="Radians between two that may lie nearer, because they see other walls: 60 degrees, by "
        "judgement.",
    )
    reach: float = Field(
        default=4.0,
        gt=0.0,
        le=1000.0,
        description="Metres searched to each side of each of them, in any heading. By judgement: more than "
        "their spacing.",
    )
    radius: float = Field(
        default=20.0,
        gt=0.0,
        le=10000.0,
        description="Metres about its middle of which a submap is searched on: the sample's radius and the "
        "reach, about.",
    )
    points: int = Field(
        default=150,
        ge=1,
        le=100000,
        description="Points that are searched with. Measured when chosen, together with the least score: "
        "places are recognized in a third of the time.",
    )
    min_score: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Least mean likelihood of the points, because a car that comes the other way sees half "
        "of the same walls; what fits by chance is refuted afterwards.",
    )
    ambiguous_share: float = Field(
        default=0.85,
        gt=0.0,
        le=1.0,
        description="Score of another place, as a share of the best, from which it is an alternative, and "
        "within one window makes it ambiguous. As in loop closure.",
    )
    same_distance: float = Field(
        default=1.0,
        gt=0.0,
        le=100.0,
        description="Metres within which two places found are the same one. By judgement.",
    )
    same_turn: float = Field(
        default=math.radians(10.0),
        gt=0.0,
        le=100.0,
        description="Radians likewise: 10 degrees, by judgement.",
    )
    min_support: int = Field(
        default=4,
        ge=1,
        le=1000,
        description="Submaps whose hypotheses must be consistent. By judgement: the 2 m from one to the "
        "next make some 10 m of path.",
    )
    clear_majority: int = Field(
        default=2,
        ge=1,
        le=1000,
        description="How many times as many submaps they must be as those of any other place. By judgement.",
    )
