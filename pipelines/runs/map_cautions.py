"""What to know of a map before its figures are believed."""

from racecar.pipelines.evaluation.wall_fit import ON_WALL, WallFit

_COARSE = 0.25
"""Metres; half the length of a small car: walls of such cells are off by as much as a parked car is."""
_CLUTTERED = 0.5
"""Share of a map near its walls from which a wrong pose would find half of its end points on walls, too."""


def cautions_of_resolution(resolution: float) -> list[str]:
    """For a map whose cells measure so many metres."""
    if resolution <= _COARSE:
        return []
    return [
        f"The map's cells are {resolution:g} m wide, so that walls and poses are known no better than that; "
        "0.05 is usual."
    ]


def cautions_of_walls(walls: WallFit) -> list[str]:
    """For a map on which end points are said to lie on walls."""
    if walls.share_of_map <= _CLUTTERED:
        return []
    return [
        f"{walls.share_of_map:.0%} of the map lies within {ON_WALL:.2f} m of a wall, so that end points on "
        "walls do not show that the pose is right; look at overlay.png, and at negate and the thresholds."
    ]
