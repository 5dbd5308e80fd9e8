"""Leaving out the beams that the map does not explain: people, furniture that was moved.

What has changed since the map was made would draw the cloud to where it seems explained by chance. The idea
is that of AMCL's beam skipping; here a beam has to fit from most of the cloud, for the few particles that
think otherwise are more often wrong than the rest. After wrong odometry all of the cloud is beside the place;
then the scan laid on the walls fits notably better, is asked instead, and tells where to look.

Where the map is wrong about much of what a scan sees, it may be wrong about the rest too, and alike for scans
taken near each other. A cloud that heeded them as if each told something new would be sure of the place where
the map's errors happen to fit, and then leave out the beams that say otherwise: such scans count less.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.sensor_model import SensorModel
from racecar.maps.geometry.se2 import Pose

Alignment = tuple[Pose, NDArray[np.float64]]
"""A pose (3,) and its covariance (3, 3)."""

_ASKED = 40
"""Particles."""
_MOST_OF_THE_CLOUD = 0.7
_NOTABLY_MORE = 0.1
"""Share of the beams."""
_FEWEST_LEFT = 0.5
"""Share of the beams; where most of them disagree, it is rather the pose that is wrong."""
_USUAL_SHARE, _STEEPNESS = 0.7, 4
"""A scan of which fewer beams fit counts by their share of that share, to such a power."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the map explains of a scan."""

    beams: Beams
    """To weigh: those explained, or all if these are too few."""
    evidence: float
    """By how much of its log-likelihood the scan counts, 0 to 1."""
    better: Alignment | None
    """Where notably more beams fit than from the cloud on average."""


def explain(
    beams: Beams, map_from_base: Pose, align: Callable[[], Alignment], sensor: SensorModel
) -> Explanation:
    """By what fits from most of a narrow cloud (N, 3), or from where ``align`` lays the scan on walls."""
    asked = map_from_base[:: max(1, len(map_from_base) // _ASKED)].copy()  # strides compile anew
    fits = sensor.fits(asked, beams)
    votes = fits.sum(axis=0)
    is_explained = votes >= _MOST_OF_THE_CLOUD * len(asked)
    better = None
    fitting = votes.sum() / len(asked)
    notably_more = fitting + _NOTABLY_MORE * len(beams)
    if notably_more < len(beams):
        alignment = align()
        fits_aligned = sensor.fits(alignment[0][None], beams)[0]
        fitting_aligned = np.count_nonzero(fits_aligned)
        if fitting_aligned > notably_more:
            is_explained, fitting, better = fits_aligned, fitting_aligned, alignment
    is_enough = np.count_nonzero(is_explained) >= _FEWEST_LEFT * len(beams)
    evidence = min(fitting / (_USUAL_SHARE * len(beams)), 1.0) ** _STEEPNESS
    return Explanation(beams.only(is_explained) if is_enough else beams, evidence, better)
