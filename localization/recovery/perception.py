"""What a scan says of a place on a surveyed map."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.recovery.surveyed_map import SurveyedMap
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose


class Perception:
    """Compares scans with a map, as the settings say."""

    def __init__(self, surveyed: SurveyedMap, config: LocalizationConfig) -> None:
        self.surveyed = surveyed
        self.config = config

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) of a scan from each of the poses (N, 3)."""
        return self.surveyed.field.log_likelihood(map_from_base, beams)

    def aligned(
        self, map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams
    ) -> tuple[Pose, NDArray[np.float64]]:
        """A pose (3,) and its covariance (3, 3), laid on the walls near by."""
        return refine(map_from_base, covariance, beams, self.surveyed.walls, self.config.alignment)

    def fit(self, map_from_base: Pose, beams: Beams) -> float | None:
        """How well a scan fits the map from a pose (3,), 0 to 1; None where it has no points."""
        return self.surveyed.field.fit(map_from_base, beams)
