"""Manual constraints: what people know of a drive or of the building, and the scans do not show."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose, transform_points

PosedAt: TypeAlias = tuple[float, float, float]
"""x and y in metres, yaw in radians."""
Place: TypeAlias = tuple[float, float]
"""x and y in metres, in the map."""


@dataclass(frozen=True)
class Moment:
    """A time in a recording."""

    seconds: float
    """Seconds since the recording began."""
    recording: int | None = None
    """Number of the recording in the session, from 0; None if there is only one."""


@dataclass(frozen=True)
class SamePlace:
    """At both moments the car was at one place."""

    first: Moment
    second: Moment
    first_from_second: PosedAt | None = None
    """The second pose of the base relative to the first; None to search for it."""


@dataclass(frozen=True)
class NotSamePlace:
    """The map takes two places for one; what ties them is cut."""

    first: Moment
    second: Moment


@dataclass(frozen=True)
class Distance:
    """The distance between two points of walls is known."""

    points: tuple[Place, Place]
    metres: float


@dataclass(frozen=True)
class Straight:
    """The wall between two of its points is straight."""

    points: tuple[Place, Place]


@dataclass(frozen=True)
class RightAngle:
    """The walls at two points are at right angles."""

    points: tuple[Place, Place]


@dataclass(frozen=True)
class Here:
    """At a moment the base was on a survey mark or at a pose of a floor plan, whose frame the map gets."""

    moment: Moment
    place: Place
    yaw: float | None = None
    """Radians; None if only the place is known."""


@dataclass(frozen=True)
class Distrust:
    """Wheels or scans were misled for a while."""

    source: Literal["wheels", "scans"]
    begin: Moment
    end: Moment


ManualConstraint: TypeAlias = SamePlace | NotSamePlace | Distance | Straight | RightAngle | Here | Distrust


def moved(constraint: ManualConstraint, new_from_map: Pose) -> ManualConstraint:
    """The same constraint on a map in another frame."""
    if isinstance(constraint, Here):
        x, y, yaw = compose(new_from_map, np.array([*constraint.place, constraint.yaw or 0.0])).tolist()
        return replace(constraint, place=(x, y), yaw=None if constraint.yaw is None else yaw)
    if (points := points_of(constraint)) is None:
        return constraint
    return with_points(constraint, transform_points(new_from_map, points))


def points_of(constraint: ManualConstraint) -> NDArray[np.float64] | None:
    """(2, 2) metres in the map: the points of walls that it names; None if it names none."""
    return np.array(constraint.points) if isinstance(constraint, Distance | Straight | RightAngle) else None


def with_points(constraint: ManualConstraint, points: NDArray[np.float64]) -> ManualConstraint:
    """A copy that names other points (2, 2)."""
    (a, b), (c, d) = points.tolist()
    if isinstance(constraint, Distance | Straight | RightAngle):
        return replace(constraint, points=((a, b), (c, d)))
    return constraint


def moments_of(constraint: ManualConstraint) -> list[Moment]:
    """The moments that it names, in order."""
    return [value for value in vars(constraint).values() if isinstance(value, Moment)]


def in_recordings_from(constraint: ManualConstraint, first: int) -> ManualConstraint:
    """The same where the recordings of its map are numbered from ``first`` on, as in a merged one."""
    moments = {
        name: replace(value, recording=(value.recording or 0) + first)
        for name, value in vars(constraint).items()
        if isinstance(value, Moment)
    }
    return replace(constraint, **moments)  # type: ignore[arg-type]
