"""What a match of scans is worth beside other measurements."""

import numpy as np
from numpy.typing import NDArray

_USUAL_RESIDUAL = 0.01
_SCALE = 0.1
"""Neighbouring beams, and the same scan in many pairs, err together: each term counts for a tenth."""
_REGULAR = 1e-3 * np.eye(3)


def match_information(hessian: NDArray[np.float64], residual: float) -> NDArray[np.float64]:
    """(3, 3) information of a match from its Hessian for unit residuals and the residual it ended with."""
    return hessian / _variance(residual) + _REGULAR


def as_prior(information: NDArray[np.float64], residual: float = 0.0) -> NDArray[np.float64]:
    """(3, 3) information of a guess in the units of the Hessian of a match that ends with such a residual."""
    return information * _variance(residual)


def _variance(residual: float) -> float:
    """What a term of the Hessian is worth; no match is as good as one between clean scans may look."""
    return max(residual, _USUAL_RESIDUAL) ** 2 / _SCALE
