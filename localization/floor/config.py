"""The settings of what is derived from a map."""

from pydantic import Field

from racecar.maps.settings import Settings


class FreeSpaceConfig(Settings):
    """Where on a map the car can be."""

    smallest_area: float = Field(
        1.0,
        ge=0,
        le=100,
        description="square metres; a smaller patch of free cells has no room for a car. By judgement: "
        "some five times the footprint of a car of 0.5 m by 0.3 m; scattered cells that a mapper leaves "
        "free are smaller",
    )
    unknown_reach: float = Field(
        0.8,
        ge=0,
        le=10,
        description="metres that the car may stand on unknown floor beside free floor. By judgement: a map "
        "may not know the floor under the car that made it, which lies within a car's length of what it saw",
    )
    largest_movable: float = Field(
        3.0,
        ge=0,
        le=100,
        description="metres; a longer obstacle is a wall, not furniture that may have been moved. By "
        "judgement: most tables and boxes are shorter, stretches of wall between two doors longer",
    )

    inverted_wall_share: float = Field(
        0.9,
        gt=0.5,
        le=1,
        description="share of the known cells from which a map may be one whose colours mean the opposite: "
        "the walls of nine maps of ours and of others take 0.01 to 0.07, and 0.97 to 0.995 when inverted",
    )
    inverted_width: float = Field(
        0.8,
        ge=0,
        le=100,
        description="metres; such a map is refused where its floor is nowhere wider. Inverted, the walls "
        "of those nine are 0.1 to 0.6 m wide at most, while their floors are wider than 2.7 m somewhere",
    )
