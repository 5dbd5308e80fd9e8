"""Settings of session merging."""

import math

from pydantic import Field

from racecar.maps.settings import Settings


class PlaceRecognitionConfig(Settings):
    """When a drive is recognized where it was found on an earlier map."""

    metres_per_radian: float = Field(
        default=2.0,
        ge=0.0,
        le=1000.0,
        description="Metres that count as much as a radian between two submaps, in how alike their views "
        "are. By judgement, as for pairs of scans.",
    )
    farthest: float = Field(
        default=6.0,
        gt=0.0,
        le=1000.0,
        description="Metres between the middles of two submaps that are matched. By judgement: as across a "
        "hall, where both see the same walls.",
    )
    tried: int = Field(
        default=4,
        ge=1,
        le=1000,
        description="Submaps of the earlier map on which one of the drive is tried, the likeliest first. By "
        "judgement.",
    )
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
    ambiguous_share: float = Field(
        default=0.85,
        gt=0.0,
        le=1.0,
        description="Score of another place, as a share of that where the drive was found, from which it is "
        "a rival. As in loop closure.",
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
        default=2,
        ge=1,
        le=1000,
        description="Submaps whose hypotheses must be consistent. Measured on 42 pairs of recordings from "
        "different buildings, never two were; drives of 10 m through a mapped room had so many.",
    )
    verified_share: float = Field(
        default=0.5,
        ge=0.0,
        le=1.0,
        description="Share of the submaps last tried that they must be, because in another building some "
        "pass by chance, sooner or later. By judgement: most of the right ones pass.",
    )
    clear_majority: int = Field(
        default=2,
        ge=1,
        le=1000,
        description="How many times as many submaps they must be as those of any other place. By judgement.",
    )
