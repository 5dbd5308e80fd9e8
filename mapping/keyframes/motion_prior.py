"""How likely a motion is before scans are matched: near to one of some guesses, or anywhere."""

from dataclasses import dataclass
from math import gamma

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between

_FREEDOM = 3.0
"""Degrees of freedom of Student's t, since wheels err by many standard deviations now and then: by judgement,
the fewest with a variance."""
_PEAK = gamma(0.5 * (_FREEDOM + 3.0)) / (gamma(0.5 * _FREEDOM) * (_FREEDOM * np.pi) ** 1.5)
"""Density of Student's t in three dimensions at its middle, in its unit (Kotz and Nadarajah, 2004)."""


@dataclass(frozen=True, eq=False)
class MotionPrior:
    """A mixture of Student's t about H guesses and a uniform density: each source errs now and then, and all
    of them where a car slides or is carried."""

    guesses: Pose
    """(H, 3) where the motion leads, as each source says."""
    shares: NDArray[np.float64]
    """(H,) how often each is right; what is left is the share of motions that none tells."""
    information: NDArray[np.float64]
    """(3, 3) of each guess that is right, in the tangent frame there."""
    volume: float
    """Square metres times radians, over which a motion that none tells is spread."""

    def log_likelihood(self, poses: Pose) -> NDArray[np.float64]:
        """(N,) of poses (N, 3), beside that of the first guess."""
        off = between(self.guesses[:, None], poses[None])
        squared = np.einsum("hni,ij,hnj->hn", off, self.information, off)
        usual = (1.0 + squared / _FREEDOM) ** (-0.5 * (_FREEDOM + 3.0))
        peak = _PEAK * np.sqrt(np.linalg.det(self.information))
        density = self.shares @ usual + (1.0 - self.shares.sum()) / (self.volume * peak)
        return np.asarray(np.log(density / self.shares[0]), dtype=np.float64)
