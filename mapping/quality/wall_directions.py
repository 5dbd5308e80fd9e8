"""Whether the walls in each scan constrain it in all directions.

In a bare corridor all walls are parallel, and scan matching cannot observe the distance travelled.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.matching.scan_store import ScanStore


def weakest_direction(store: ScanStore) -> NDArray[np.float64]:
    """(K,) share of a scan's lines that constrain its weakest direction: at most a half, 0 without lines."""
    packed = store.packed()
    hold = np.zeros(len(packed.counts))
    for row, normals in enumerate(packed.normals):
        x, y = normals[: packed.counts[row]].T.astype(np.float64)
        moment = np.array([[x @ x, x @ y], [x @ y, y @ y]])
        lines = moment[0, 0] + moment[1, 1]
        hold[row] = np.linalg.eigvalsh(moment)[0] / lines if lines > 0.0 else 0.0
    weakest: NDArray[np.float64] = hold[store.row_of]
    return weakest
