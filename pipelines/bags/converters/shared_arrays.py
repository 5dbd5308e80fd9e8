"""Arrays that many scans share."""

import numpy as np
from numpy.typing import NDArray


def frozen(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The array itself, not writeable from now on, because many scans share it."""
    values.flags.writeable = False
    return values
