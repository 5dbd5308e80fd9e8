"""Validate the arrays of a session: shapes and types as in `racecar.mapping.session.session`, and plausible
numbers.

A session may come from a stranger, or from a disk that lost some bits. Errors are reported here rather than
minutes later, in a kernel that reads beyond an array or a solver that does not converge.
"""

from typing import NamedTuple

import numpy as np

from racecar.mapping.graph.constraint import KINDS
from racecar.mapping.grid.rendering import LONGEST_RAY
from racecar.sensors.arrays import ArrayLayout, Arrays, check_layout

_FARTHEST = 1e7
"""Metres or radians; no drive is longer, since it is a quarter of the earth's circumference."""
_MOST_INFORMATION = 1e15
"""Per square metre or radian, because a match known to a micrometre, which no laser measures, has 1e12."""
_UNIT = 1.01
"""Length of a unit vector plus rounding, because normals are stored in 16 bits."""


class _Numbers(NamedTuple):
    layout: ArrayLayout
    low: float
    high: float


def _places(*shape: str | int) -> _Numbers:
    return _Numbers(ArrayLayout("f", shape), -_FARTHEST, _FARTHEST)


def _information(count: str) -> _Numbers:
    return _Numbers(ArrayLayout("f", (count, 3, 3)), -_MOST_INFORMATION, _MOST_INFORMATION)


def _whole(low: float, high: float, *shape: str | int) -> _Numbers:
    return _Numbers(ArrayLayout("iu", shape), low, high)


_INT32, _INT64 = float(np.iinfo(np.int32).max), float(np.iinfo(np.int64).max)


def _constraints(part: str, count: str) -> dict[str, _Numbers]:
    return {
        f"{part}.keyframes": _whole(0, _INT32, count, 2),
        f"{part}.poses": _places(count, 3),
        f"{part}.information": _information(count),
        f"{part}.kinds": _whole(0, len(KINDS) - 1, count),
    }


_SESSION: dict[str, _Numbers] = {
    "keyframe_from_base": _places("K", 3),
    "map_from_keyframe": _places("K", 3),
    "times.stamps": _whole(-_INT64, _INT64, "K"),
    "times.recordings": _whole(0, _INT32, "K"),
    "times.names": _Numbers(ArrayLayout("U", ("R",)), 0, 0),
    "times.spans": _whole(-_INT64, _INT64, "R", 2),
    "times.drives": _whole(0, _INT32, "R"),
    "scans.counts": _whole(0, np.iinfo(np.int16).max, "K"),
    "scans.points": _places("points", 2),
    "scans.normals": _Numbers(ArrayLayout("f", ("points", 2)), -_UNIT, _UNIT),
    "rays.lengths": _whole(0, _INT32, "K"),
    "rays.returns": _whole(0, _INT32, "K"),
    "rays.ends": _Numbers(ArrayLayout("f", ("ends", 2)), -LONGEST_RAY, LONGEST_RAY),
    **_constraints("constraints", "C"),
    "loops.submaps": _whole(0, _INT32, "S", 3),
    "loops.path": _places("K"),
    "loops.edges": _whole(0, _INT32, "E", 3),
    "loops.variances": _Numbers(ArrayLayout("f", ("V", 2)), 0.0, _FARTHEST),
    "loops.hypothesis_submaps": _whole(0, _INT32, "H", 2),
    "loops.hypothesis_poses": _places("H", 3),
    "loops.hypothesis_information": _information("H"),
    "loops.hypothesis_reaches": _places("H"),
    "loops.hypothesis_accepted": _Numbers(ArrayLayout("b", ("H",)), 0, 1),
    "loops.log_names": _Numbers(ArrayLayout("U", ("L",)), 0, 0),
    "loops.log_counts": _whole(0, _INT64, "L"),
}
"""The arrays of a session by definition, as its module documents them."""

_MEASURED: dict[str, _Numbers] = {
    "measured.map_from_keyframe": _places("K", 3),
    **_constraints("measured.constraints", "M"),
    "measured.mended_by": _Numbers(ArrayLayout("U", (1,)), 0, 0),
}
"""Those of a session that was corrected by hand, by definition."""


def checked_session(arrays: Arrays) -> Arrays:
    """Validate the arrays of a session. Raises ValueError naming the invalid array."""
    known = {**_SESSION, **(_MEASURED if any(name.startswith("measured.") for name in arrays) else {})}
    check_layout(arrays, {name: numbers.layout for name, numbers in known.items()})
    for name, numbers in known.items():
        if numbers.layout.kinds != "U":
            array = arrays[name].astype(np.float64)
            if not np.all((array >= numbers.low) & (array <= numbers.high)):
                raise ValueError(f"{name} holds a number that cannot be")
    keyframes, submaps = len(arrays["map_from_keyframe"]), len(arrays["loops.submaps"])
    if keyframes == 0:
        raise ValueError("map_from_keyframe is empty")
    for lengths, packed in (("scans.counts", "scans.points"), ("rays.lengths", "rays.ends")):
        if int(arrays[lengths].astype(np.int64).sum()) != len(arrays[packed]):
            raise ValueError(f"{lengths} do not add up to {packed}")
    first, middle, last = arrays["loops.submaps"].astype(np.int64).T
    ends = [arrays[name] for name in arrays if name.endswith("constraints.keyframes")]
    are_in_order = {
        "times.recordings": arrays["times.recordings"].astype(np.int64) < len(arrays["times.names"]),
        "rays.returns": arrays["rays.returns"].astype(np.int64) <= arrays["rays.lengths"].astype(np.int64),
        "constraints.keyframes": np.concatenate(ends).astype(np.int64) < keyframes,
        "loops.submaps": (first <= middle) & (middle <= last) & (last < keyframes),
        "loops.hypothesis_submaps": arrays["loops.hypothesis_submaps"].astype(np.int64) < submaps,
        "loops.edges": arrays["loops.edges"][:, :2].astype(np.int64) < submaps,
        "loops.variances": middle < len(arrays["loops.variances"]),
    }
    for name, are in are_in_order.items():
        if not are.all():
            raise ValueError(f"{name} point beyond what there is")
    return arrays
