"""The information matrix of a scan match, for combination with other measurements."""

import numpy as np
from numpy.typing import NDArray

_USUAL_RESIDUAL = 0.01
"""Metres; lower bound of the residual that a match's information assumes, because lasers err by as much."""
_INDEPENDENCE = 0.1
"""Weight of a term in a match's information, because neighbouring beams, and one scan in many pairs, have
correlated errors. Measured in a prototype on aces, fr079 and intel."""
_REGULAR = 1e-3 * np.eye(3)
"""Information, in 1/m² and 1/rad², added so that it is invertible: a standard deviation of 30 m or rad."""


def match_information(hessian: NDArray[np.float64], residual: float) -> NDArray[np.float64]:
    """(3, 3) information of a match, from its Hessian for unit residuals and its final residual."""
    return hessian / _variance(residual) + _REGULAR


def as_prior(information: NDArray[np.float64], residual: float = 0.0) -> NDArray[np.float64]:
    """(3, 3) information of a prior in the units of the Hessian of a match that ends with this residual."""
    return information * _variance(residual)


def _variance(residual: float) -> float:
    """Effective variance of one term of the Hessian."""
    return max(residual, _USUAL_RESIDUAL) ** 2 / _INDEPENDENCE
