"""Whether scans can observe distance travelled: along a bare corridor they cannot."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.scan import Scan

_MIN_SHOWN = 0.15
"""Mean squared cosine between surface normals and direction of travel from which distance is observable.
Measured: 0.1 in the barest corridor of a simulated building, 0.25 and more in rooms; nothing changes between
0.1 and 0.3 there."""
_GAP = 6.0
"""Gap of neighbouring returns on one surface in multiples of the beam spacing, because walls are seen
obliquely."""


def shows_distance(scan: Scan, motion: Pose) -> bool:
    """Whether surfaces in a scan face the direction of its motion (3,)."""
    normals = _normals(scan)
    along = motion[:2] / max(float(np.hypot(motion[0], motion[1])), 1e-9)
    return len(normals) > 0 and float(np.mean((normals @ along) ** 2)) > _MIN_SHOWN


def _normals(scan: Scan) -> NDArray[np.float64]:
    """(N, 2) normals of the surfaces between returns at least two degrees apart, in the laser's frame."""
    is_hit = np.isfinite(scan.ranges) & (scan.ranges > 0.0)
    bearings, ranges = scan.bearings[is_hit], scan.ranges[is_hit]
    apart = 2 * max(len(bearings) // 180, 1)  # so that noise does not tilt surfaces nearby
    if len(bearings) <= apart:
        return np.zeros((0, 2))
    points = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])
    steps = points[apart:] - points[:-apart]
    lengths = np.hypot(*steps.T)
    usual = apart * float(np.median(np.diff(bearings))) * ranges[:-apart]
    is_surface = (lengths > 1e-6) & (lengths < _GAP * usual)
    normals: NDArray[np.float64] = steps[is_surface, ::-1] / lengths[is_surface, None] * [-1.0, 1.0]
    return normals
