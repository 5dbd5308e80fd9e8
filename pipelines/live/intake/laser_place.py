"""Where a laser sits on the car; nodes remember it, as ``/tf_static`` may take seconds to come."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LaserPlace:
    """A laser's place, by the names of the frames."""

    base_frame: str
    laser_frame: str
    base_from_laser: NDArray[np.float64]
    """(4, 4)"""

    @classmethod
    def from_fields(cls, fields: object) -> "LaserPlace | None":
        """From a mapping read from a file; None where it does not hold the place of a laser."""
        try:
            names = (str(fields["base_frame"]), str(fields["laser_frame"]))  # type: ignore[index]
            matrix = np.array(fields["base_from_laser"], dtype=np.float64)  # type: ignore[index]
        except (TypeError, KeyError, ValueError):
            return None
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            return None
        return cls(*names, matrix)
