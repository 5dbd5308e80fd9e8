"""Leaving out the beams that the map does not explain: people, furniture that was moved.

What has changed since the map was made would draw the cloud to where it seems explained by chance. The idea
is that of AMCL's beam skipping; here a beam has to fit from most of the cloud, for the few particles that
think otherwise are more often wrong than the rest. After wrong odometry all of the cloud is beside the place;
then the scan laid on the walls fits notably better, and is asked instead.
"""

from collections.abc import Callable

import numpy as np

from localization.beams import Beams
from localization.sensor_model import SensorModel
from maps.se2 import Pose

_ASKED = 40
"""Particles."""
_MOST_OF_THE_CLOUD = 0.7
_NOTABLY_MORE = 0.1
"""Share of the beams."""
_FEWEST_LEFT = 0.25
"""Share of the beams; where fewer would be left, it is rather the pose that is wrong."""


def skip_unexplained(
    beams: Beams, map_from_base: Pose, align: Callable[[], Pose], sensor: SensorModel
) -> Beams:
    """The beams that fit from most of a narrow cloud (N, 3), or else from where the scan lies on walls (3,).

    All of them if those are too few. ``align`` finds where it does.
    """
    asked = map_from_base[:: max(1, len(map_from_base) // _ASKED)]
    is_explained = sensor.fits(asked, beams).sum(axis=0) >= _MOST_OF_THE_CLOUD * len(asked)
    left = np.count_nonzero(is_explained)
    notably_more = left + _NOTABLY_MORE * len(beams)
    if notably_more < len(beams):
        fits_aligned = sensor.fits(align()[None], beams)[0]
        if np.count_nonzero(fits_aligned) > notably_more:
            is_explained, left = fits_aligned, np.count_nonzero(fits_aligned)
    return beams.only(is_explained) if left >= _FEWEST_LEFT * len(beams) else beams
