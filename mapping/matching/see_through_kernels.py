"""Does one scan look through what the other one saw? The inner loop."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.mapping.matching.scan_matching_kernels import TABLE_SIZE


@njit(cache=True, nogil=True)
def count_see_through(
    points: NDArray[np.float32],
    count: int,
    seen_from: NDArray[np.float64],
    viewer: NDArray[np.float32],
    viewer_count: int,
    viewer_table: NDArray[np.int16],
    max_range: float,
    tolerance: float,
    max_gap: float,
    tally: NDArray[np.int64],
) -> None:
    """Add to ``tally``: points that lie on the viewer's surfaces, that it looks through, that it cannot tell.

    ``seen_from`` (3,) is viewer_from_points. A point is judged where the viewer has beams on both sides
    of its bearing, less than ``max_gap`` radians apart, and beyond both or before both of their returns.
    """
    c, s = np.cos(seen_from[2]), np.sin(seen_from[2])
    for i in range(count):
        x = c * points[i, 0] - s * points[i, 1] + seen_from[0]
        y = s * points[i, 0] + c * points[i, 1] + seen_from[1]
        distance = np.sqrt(x * x + y * y)
        if distance > max_range or distance < 0.3:
            tally[2] += 1
            continue
        bearing = np.arctan2(y, x)
        j = viewer_table[min(max(int((bearing + np.pi) * TABLE_SIZE / (2.0 * np.pi)), 0), TABLE_SIZE)]
        while j < viewer_count and np.arctan2(viewer[j, 1], viewer[j, 0]) < bearing:
            j += 1
        if j == 0 or j >= viewer_count:
            tally[2] += 1
            continue
        left = np.arctan2(viewer[j - 1, 1], viewer[j - 1, 0])
        right = np.arctan2(viewer[j, 1], viewer[j, 0])
        if right - left > max_gap:
            tally[2] += 1
            continue
        before = np.sqrt(viewer[j - 1, 0] ** 2 + viewer[j - 1, 1] ** 2)
        after = np.sqrt(viewer[j, 0] ** 2 + viewer[j, 1] ** 2)
        # A point near either return, or between them on the line that joins them, lies on the surface.
        near, far = min(before, after), max(before, after)
        slack = tolerance + 0.02 * distance
        if near - slack <= distance <= far + slack:
            tally[0] += 1
        elif distance < near - slack:
            tally[1] += 1
        else:
            tally[2] += 1
