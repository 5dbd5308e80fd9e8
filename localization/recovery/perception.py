"""What a scan says of a place on a surveyed map."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.recovery.surveyed_map import SurveyedMap
from racecar.localization.refinement.refinement import aligned, refine
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.wall_surface import WallSurface
from racecar.maps.geometry.se2 import Pose

_ASKED = 40
"""Particles of a cloud from which each point is looked at. By judgement: a share among 40 is known to 8 %."""
_EXPLAINED = 0.8
"""Mean fit of a point from those, below which it is left out. Measured: with 0.7 moved furniture draws the
cloud aside by a quarter more, without it three times as much."""
_FEWEST_LEFT = 0.3
"""Share of the points that must be left, or none is left out: by judgement, as a cloud that has gone astray
is not to choose what suits it."""


class Perception:
    """Compares scans with a map."""

    def __init__(self, surveyed: SurveyedMap) -> None:
        self.surveyed = surveyed
        self._surface = WallSurface(surveyed.walls)

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) of a scan from each of the poses (N, 3)."""
        return self.surveyed.field.log_likelihood(map_from_base, beams, self._surface.metres)

    def aligned(self, map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams) -> Pose:
        """A pose (3,) of some covariance (3, 3), laid on the walls near by."""
        return aligned(map_from_base, covariance, beams, self.surveyed.walls, self._surface.metres)

    def refined(
        self, map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams
    ) -> tuple[Pose, NDArray[np.float64]]:
        """That, and its covariance (3, 3)."""
        return refine(map_from_base, covariance, beams, self.surveyed.walls, self._surface.metres)

    def fit(self, map_from_base: Pose, beams: Beams) -> float | None:
        """How well a scan fits the map from a pose (3,), the mean fit of its end points; None without any."""
        fits = self.surveyed.field.fits(map_from_base[None], beams, self._surface.metres)
        return float(fits.mean()) if len(fits) > 0 else None

    def learn_surface(self, map_from_base: Pose, beams: Beams) -> None:
        """Learn where within their cells walls lie, from a scan at a pose (3,) that is known."""
        self._surface.learn(map_from_base, beams.points_in_base, beams.base_from_laser)

    def explained(self, map_from_base: Pose, beams: Beams) -> Beams:
        """Those that fit the map from most of a narrow cloud (N, 3); all if these are too few.

        The idea is that of AMCL's beam skipping (nav2): what has changed since the map was made would draw
        the cloud to where it seems explained by chance.
        """
        asked = map_from_base[:: max(1, len(map_from_base) // _ASKED)].copy()  # strides compile anew
        returns = beams.returns
        is_explained = self.surveyed.field.fits(asked, returns, self._surface.metres) >= _EXPLAINED
        is_enough = np.count_nonzero(is_explained) >= _FEWEST_LEFT * len(returns)
        return returns.only(is_explained) if is_enough else returns
