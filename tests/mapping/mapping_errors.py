"""How far a mapped drive is from the truth."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between


def errors(result: MappingResult, map_from_base: Pose) -> NDArray[np.float64]:
    """(N,) metres from the truth (N, 3), both seen from their first scans."""
    true = map_from_base[: len(result.trajectory)]
    error = between(
        between(true[0], true), between(result.trajectory.map_from_base[0], result.trajectory.map_from_base)
    )
    distances: NDArray[np.float64] = np.hypot(error[:, 0], error[:, 1])
    return distances


def mean_error(result: MappingResult, map_from_base: Pose) -> float:
    """Metres, of the same."""
    return float(errors(result, map_from_base).mean())
