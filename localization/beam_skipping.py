"""Leaving out the beams that the map does not explain: people, furniture that was moved.

What has changed since the map was made would draw the cloud to where it seems explained by chance. The idea
is that of AMCL's beam skipping; here a beam has to fit from most of the cloud, for the few particles that
think otherwise are more often wrong than the rest. After wrong odometry all of the cloud is beside the place;
then the scan laid on the walls fits notably better, is asked instead, and tells where to look.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams
from localization.sensor_model import SensorModel
from maps.se2 import Pose

Alignment = tuple[Pose, NDArray[np.float64]]
"""A pose (3,) and its covariance (3, 3)."""

_ASKED = 40
"""Particles."""
_MOST_OF_THE_CLOUD = 0.7
_NOTABLY_MORE = 0.1
"""Share of the beams."""
_FEWEST_LEFT = 0.5
"""Share of the beams; where most of them disagree, it is rather the pose that is wrong."""


def skip_unexplained(
    beams: Beams, map_from_base: Pose, align: Callable[[], Alignment], sensor: SensorModel
) -> tuple[Beams, Alignment | None]:
    """The beams that fit from most of a narrow cloud (N, 3), or from where ``align`` lays the scan on walls.

    All of them if those are too few. The alignment comes with them where notably more beams fit from there
    than from the cloud on average.
    """
    asked = map_from_base[:: max(1, len(map_from_base) // _ASKED)].copy()  # strides compile anew
    fits = sensor.fits(asked, beams)
    votes = fits.sum(axis=0)
    is_explained = votes >= _MOST_OF_THE_CLOUD * len(asked)
    better = None
    notably_more = votes.sum() / len(asked) + _NOTABLY_MORE * len(beams)
    if notably_more < len(beams):
        alignment = align()
        fits_aligned = sensor.fits(alignment[0][None], beams)[0]
        if np.count_nonzero(fits_aligned) > notably_more:
            is_explained, better = fits_aligned, alignment
    is_enough = np.count_nonzero(is_explained) >= _FEWEST_LEFT * len(beams)
    return beams.only(is_explained) if is_enough else beams, better
