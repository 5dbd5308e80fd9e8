"""What a scan says of a place on a surveyed map."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.agreement import Agreement, agreement_of
from racecar.localization.recovery.surveyed_map import SurveyedMap
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.beam_skipping import Alignment, Explanation, explain
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose


class Perception:
    """Compares scans with a map, as the settings say."""

    def __init__(self, surveyed: SurveyedMap, config: LocalizationConfig) -> None:
        self.surveyed = surveyed
        self.config = config
        self._sensor = surveyed.beam_model(config)

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) of a scan from each of the poses (N, 3)."""
        return self._sensor.log_likelihood(map_from_base, beams)

    def explanation(self, particles: ParticleFilter, beams: Beams) -> Explanation:
        """What the map explains of a scan from a narrow cloud, or from beside it where that explains more."""

        def align() -> Alignment:
            mean, covariance, _ = particles.moments()
            return self.aligned(mean, covariance, beams)

        return explain(beams, particles.map_from_base, align, self._sensor, self.config.beam_skipping)

    def aligned(self, map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams) -> Alignment:
        """A pose (3,) and its covariance (3, 3), laid on the walls near by."""
        return refine(map_from_base, covariance, beams, self.surveyed.walls, self.config.alignment)

    def agreement(self, map_from_base: Pose, beams: Beams) -> Agreement | None:
        """How the beams agree with the map from a pose (3,).

        None without beams, and from inside an obstacle, where there is no saying.
        """
        return agreement_of(map_from_base, beams, self.surveyed.free_space, self.config.lost_detector)
