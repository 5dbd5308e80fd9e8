"""What the filter asks of a sensor model."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose


class SensorModel(Protocol):
    """How likely a scan is from a pose on the map."""

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), to the power 1/squash.

        A pose where the car cannot be gets what the least likely readings would give.
        """

    def fits(self, map_from_base: Pose, beams: Beams) -> NDArray[np.bool_]:
        """(N, B) whether each beam agrees with the map from each of the poses (N, 3)."""
