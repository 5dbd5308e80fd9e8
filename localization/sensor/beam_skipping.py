"""Leaving out the beams that the map does not explain: people, furniture that was moved.

What has changed since the map was made would draw the cloud to where it seems explained by chance. The idea
is that of AMCL's beam skipping (nav2); here a beam has to agree with the map from most of the cloud, because
the few particles that say otherwise are more often wrong than the rest. After wrong odometry the whole cloud
may be beside the true place; then more beams agree from where the scan is aligned with the walls, this place
decides instead, and particles are proposed there.

Where the map is wrong about much of what a scan sees, it may be wrong about the rest too, and in the same way
for scans taken near each other. A cloud that counted them as independent would become sure of the place where
the map's errors happen to fit, and then leave out the beams that say otherwise: such scans count less.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.config import BeamSkippingConfig
from racecar.maps.geometry.se2 import Pose

Alignment = tuple[Pose, NDArray[np.float64]]
"""A pose (3,) and its covariance (3, 3)."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the map explains of a scan."""

    beams: Beams
    """To weigh: those explained, or all if these are too few."""
    evidence: float
    """Share of its log-likelihood by which the scan counts, 0 to 1."""
    better: Alignment | None
    """Where notably more beams fit than from the cloud on average."""


def explain(
    beams: Beams,
    map_from_base: Pose,
    align: Callable[[], Alignment],
    sensor: BeamModel,
    config: BeamSkippingConfig,
) -> Explanation:
    """By what agrees from most of a narrow cloud (N, 3), or from where ``align`` puts the scan on walls."""
    asked = map_from_base[:: max(1, len(map_from_base) // config.particles)].copy()  # strides compile anew
    fits = sensor.fits(asked, beams)
    votes = fits.sum(axis=0)
    is_explained = votes >= config.most_of_cloud * len(asked)
    better = None
    fitting = votes.sum() / len(asked)
    notably_more = fitting + config.notably_more * len(beams)
    if notably_more < len(beams):
        alignment = align()
        fits_aligned = sensor.fits(alignment[0][None], beams)[0]
        fitting_aligned = np.count_nonzero(fits_aligned)
        if fitting_aligned > notably_more:
            is_explained, fitting, better = fits_aligned, fitting_aligned, alignment
    is_enough = np.count_nonzero(is_explained) >= config.fewest_left * len(beams)
    evidence = min(fitting / (config.usual_share * len(beams)), 1.0) ** config.steepness
    return Explanation(beams.only(is_explained) if is_enough else beams, evidence, better)
