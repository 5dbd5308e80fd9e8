"""Settings of how a race track is found on a map."""

from pydantic import Field

from racecar.maps.settings import Settings


class TrackConfig(Settings):
    """What counts as a lap, and how its middle is drawn."""

    spacing: float = Field(
        default=0.1, gt=0.0, le=10.0, description="Metres between points of the centre line. By judgement."
    )
    shortest_lap: float = Field(
        default=5.0,
        gt=0.0,
        le=1e5,
        description="Metres of path of a lap at least. By judgement: a small car's smallest circle is 4 m.",
    )
    closing_distance: float = Field(
        default=2.0,
        gt=0.0,
        le=100.0,
        description="Metres from where a lap began to where it ends, at most; a straight line closes it. By "
        "judgement: less than from a lane to the lane beside it.",
    )
    closing_turn: float = Field(
        default=0.8,
        gt=0.0,
        le=3.2,
        description="Radians between both headings, at most. By judgement: who crosses the path comes at a "
        "right angle.",
    )
    smallest_obstacle: float = Field(
        default=0.02,
        ge=0.0,
        le=10.0,
        description="Square metres of unseen floor that bound a track; less is a gap between beams. By "
        "judgement.",
    )
    smoothing: float = Field(
        default=0.5,
        ge=0.0,
        le=10.0,
        description="Metres along the centre line over which it is smoothed, a standard deviation. Measured "
        "on the shipped track: at 0.3 normals as long as the track is wide cross one another, at 0.5 none.",
    )
    wall_radius: float = Field(
        default=0.08,
        gt=0.0,
        le=1.0,
        description="Metres about the beginning of a wall's cells in which its returns are looked for. By "
        "judgement: more than lasers err, less than what stands at a wall is away from it. Measured on the "
        "shipped track: without it, cells of 2 cm make widths 2.7 cm too small.",
    )
