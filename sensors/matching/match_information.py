"""What a match of scans is worth beside other measurements."""

import numpy as np
from numpy.typing import NDArray

_USUAL_RESIDUAL = 0.01
"""Metres; a match is never taken to be better than with this residual, however clean its scans, because
lasers err by as much."""
_INDEPENDENCE = 0.1
"""What a term counts for in a match's information, because neighbouring beams, and the same scan in many
pairs, err together. Measured in a prototype on aces, fr079 and intel."""
_REGULAR = 1e-3 * np.eye(3)
"""Information, in 1/m² and 1/rad², added so that it can be inverted: a standard deviation of 30 m or rad."""


def match_information(hessian: NDArray[np.float64], residual: float) -> NDArray[np.float64]:
    """(3, 3) information of a match from its Hessian for unit residuals and the residual it ended with."""
    return hessian / _variance(residual) + _REGULAR


def as_prior(information: NDArray[np.float64], residual: float = 0.0) -> NDArray[np.float64]:
    """(3, 3) information of a guess in the units of the Hessian of a match that ends with such a residual."""
    return information * _variance(residual)


def _variance(residual: float) -> float:
    """What a term of the Hessian is worth."""
    return max(residual, _USUAL_RESIDUAL) ** 2 / _INDEPENDENCE
