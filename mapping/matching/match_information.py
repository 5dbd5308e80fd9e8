"""What a match of scans is worth beside other measurements."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.config import PointToLineConfig

_DEFAULT = PointToLineConfig()
_REGULAR = 1e-3 * np.eye(3)
"""Information, in 1/m² and 1/rad², added so that it can be inverted: a standard deviation of 30 m or rad."""


def match_information(
    hessian: NDArray[np.float64], residual: float, config: PointToLineConfig = _DEFAULT
) -> NDArray[np.float64]:
    """(3, 3) information of a match from its Hessian for unit residuals and the residual it ended with."""
    return hessian / _variance(residual, config) + _REGULAR


def as_prior(
    information: NDArray[np.float64], residual: float = 0.0, config: PointToLineConfig = _DEFAULT
) -> NDArray[np.float64]:
    """(3, 3) information of a guess in the units of the Hessian of a match that ends with such a residual."""
    return information * _variance(residual, config)


def _variance(residual: float, config: PointToLineConfig) -> float:
    """What a term of the Hessian is worth; no match is as good as one between clean scans may look."""
    return max(residual, config.usual_residual) ** 2 / config.independence
