"""The settings of the alignment of the estimate with the walls."""

from typing import Annotated

from pydantic import Field

from racecar.maps.settings import Settings


class AlignmentConfig(Settings):
    """Robust alignment of a scan's end points with the nearest walls, about the cloud's mean."""

    fewest_points: int = Field(
        10, ge=3, le=10_000, description="end points below which there is no alignment. By judgement"
    )
    largest_move: float = Field(
        0.5,
        gt=0,
        le=3,
        description="metres, or radians, that an estimate may be moved by; beyond, the walls are others. By "
        "judgement: about the width of a cloud that counts as tracked",
    )
    scales: tuple[Annotated[float, Field(ge=0.01, le=10)], ...] = Field(
        (0.3, 0.2, 0.1, 0.1, 0.07, 0.07),
        min_length=1,
        max_length=100,
        description="metres from a wall, one per step, beyond which a point counts less and less (the "
        "weights of Geman and McClure): from wide, to find the walls, to narrow, to leave out people. By "
        "judgement; alignment took session_A's error from 0.13 to 0.06 m",
    )
    wall_noise: float = Field(
        0.05,
        gt=0,
        le=1,
        description="standard deviation in metres of a point on a wall: a cell of a usual map",
    )
    points_per_observation: float = Field(
        4.0,
        ge=1,
        le=1000,
        description="points that together count as one, since neighbours lie on the same wall and err "
        "alike. By judgement",
    )
    cloud_width: float = Field(
        2.0,
        ge=1,
        le=100,
        description="the cloud holds the pose as if this many times as wide, since it saw the same scan, and "
        "shares the sensor model's errors. By judgement",
    )
    least_cloud: float = Field(
        0.05,
        gt=0,
        le=10,
        description="metres, or radians, added to that width (in squares), for a cloud that collapsed. By "
        "judgement: a cell of a usual map",
    )
