"""Manual constraints as entries of ``edits.yaml``.

.. code-block:: yaml

    - same_place: [12.4, 95.0]        # seconds since the recording began
      pose: [0.1, 0.0, 5.0]           # of the second relative to the first, metres and degrees; optional
    - not_same_place: [30.5, 71.0]
    - distance: [[1.0, 2.0], [9.0, 2.0]]
      metres: 8.02
    - straight: [[0.0, 1.0], [30.0, 1.2]]
    - right_angle: [[0.0, 1.0], [3.0, 4.0]]
    - here: 12.4
      pose: [3.0, 4.0, 90.0]          # or [3.0, 4.0], where only the place is known
    - distrust: [40.0, 44.5]
      source: wheels                  # or scans

In a map of several recordings, ``recordings: [1, 2]`` says whose moments are meant.
"""

import math
from typing import Any

import yaml

from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Here,
    ManualConstraint,
    Moment,
    NotSamePlace,
    RightAngle,
    SamePlace,
    Straight,
    moments_of,
)
from racecar.maps.errors import UserError
from racecar.pipelines.files.entry_values import check_keys, is_number, is_numbers, number_of, points_of

_KEYS = {
    "same_place": ("pose", "recordings"),
    "not_same_place": ("recordings",),
    "distance": ("metres",),
    "straight": (),
    "right_angle": (),
    "here": ("pose", "recordings"),
    "distrust": ("source", "recordings"),
}
"""The kinds of constraints, and what each may state."""
CONSTRAINT_KINDS = tuple(_KEYS)
_LONGEST = 1e6
"""Metres of a distance; no building is longer."""


def constraint_of(entry: dict[Any, Any], kind: str, where: str) -> ManualConstraint:
    """The manual constraint of an entry. Raises UserError that explains the first mistake."""
    keys = [kind, *_KEYS[kind]]
    check_keys(entry, keys, ", ".join(keys), where)
    value = entry[kind]
    if kind in ("distance", "straight", "right_angle"):
        points = points_of(value, kind, where)
        if len(points) != 2 or not (points[0] != points[1]).any():
            raise UserError(f"{where}: {kind} needs two points of walls that differ.")
        (a, b), (c, d) = points.tolist()
        if kind == "distance":
            return Distance(((a, b), (c, d)), number_of(entry, "metres", 0.0, _LONGEST, "metres", where))
        return (Straight if kind == "straight" else RightAngle)(((a, b), (c, d)))
    if kind == "here":
        (moment,) = _moments([value], entry, kind, where)
        pose = entry.get("pose", [])
        if not is_numbers(pose, 2, 3):
            raise UserError(f"{where}: pose should be [x, y] in metres, or [x, y, yaw] with yaw in degrees.")
        x, y, *yaw = pose
        return Here(moment, (float(x), float(y)), math.radians(yaw[0]) if yaw else None)
    if not isinstance(value, list) or len(value) != 2:
        raise UserError(f"{where}: {kind} should be two moments in seconds, such as [12.4, 95.0].")
    first, second = _moments(value, entry, kind, where)
    if kind == "distrust":
        if entry.get("source") not in ("wheels", "scans"):
            raise UserError(f"{where}: source should be wheels or scans.")
        return Distrust(entry["source"], first, second)
    if kind == "not_same_place":
        return NotSamePlace(first, second)
    if (pose := entry.get("pose")) is None:
        return SamePlace(first, second)
    if not is_numbers(pose, 3):
        raise UserError(f"{where}: pose should be [x, y, yaw] in metres and degrees.")
    x, y, degrees = pose
    return SamePlace(first, second, (float(x), float(y), math.radians(degrees)))


def _moments(values: list[Any], entry: dict[Any, Any], kind: str, where: str) -> list[Moment]:
    if not all(is_number(value) for value in values):
        raise UserError(f"{where}: {kind} should name moments in seconds since the recording began.")
    numbers = entry.get("recordings", [None] * len(values))
    if not isinstance(numbers, list) or len(numbers) != len(values):
        raise UserError(f"{where}: recordings should be a list of {len(values)}, the number for each moment.")
    for number in numbers:
        if number is not None and (isinstance(number, bool) or not isinstance(number, int) or number < 1):
            raise UserError(f"{where}: recordings are numbered from 1 on, as the report lists them.")
    return [
        Moment(float(value), None if number is None else number - 1)
        for value, number in zip(values, numbers, strict=True)
    ]


def text_of_constraint(constraint: ManualConstraint) -> str:
    """The entry of a constraint, exactly."""
    further: dict[str, object] = {}
    moments = moments_of(constraint)
    seconds = [moment.seconds for moment in moments]
    value: object = seconds
    match constraint:
        case SamePlace():
            kind = "same_place"
            if (pose := constraint.first_from_second) is not None:
                further["pose"] = [pose[0], pose[1], math.degrees(pose[2])]
        case NotSamePlace():
            kind = "not_same_place"
        case Distance():
            kind, value = "distance", [list(point) for point in constraint.points]
            further["metres"] = constraint.metres
        case Straight():
            kind, value = "straight", [list(point) for point in constraint.points]
        case RightAngle():
            kind, value = "right_angle", [list(point) for point in constraint.points]
        case Here():
            kind, value = "here", seconds[0]
            yaw = [] if constraint.yaw is None else [math.degrees(constraint.yaw)]
            further["pose"] = [*constraint.place, *yaw]
        case Distrust():
            kind = "distrust"
            further["source"] = constraint.source
    if any(moment.recording is not None for moment in moments):
        further["recordings"] = [(moment.recording or 0) + 1 for moment in moments]
    lines = [f"- {kind}: {_in_line(value)}\n"]
    return "".join([*lines, *(f"  {key}: {_in_line(each)}\n" for key, each in further.items())])


def _in_line(value: object) -> str:
    """As YAML on one line; a list of one, since scalars alone get an end mark."""
    listed: str = yaml.safe_dump([value], default_flow_style=True, width=math.inf)
    return listed.strip()[1:-1]
