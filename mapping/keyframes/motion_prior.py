"""How likely a motion is before scans are matched: near to one of some guesses, or anywhere."""

from math import gamma

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between

_FIRST_SHARE = 0.95
"""How often the first guess, which is the wheels' where there are any, is right, as a share of this and
`_OTHER_SHARE` for each further guess. By judgement: wheels slip now and then."""
_OTHER_SHARE = 0.005
"""The same of each further guess, and of the first where wheels repeat one pose to the last bit, as a driver
that hangs does. By judgement: along an arc or a bare corridor scans fit nearly everywhere."""
_NONE_SHARE = 0.003
"""How often none of the guesses is right. By judgement: wheels slip or report nonsense."""
_CARRIED_SHARE = 0.3
"""The same after a gap in which the car stood, since it may have been moved by hand."""
_FREEDOM = 3.0
"""Degrees of freedom of Student's t, since wheels err by many standard deviations now and then: by judgement,
the fewest with a variance."""
_PEAK = gamma(0.5 * (_FREEDOM + 3.0)) / (gamma(0.5 * _FREEDOM) * (_FREEDOM * np.pi) ** 1.5)
"""Density of Student's t in three dimensions at its middle, in its unit (Kotz and Nadarajah, 2004)."""


def guess_shares(count: int, *, is_first_doubted: bool, is_left_alone: bool) -> NDArray[np.float64]:
    """How often each of so many guesses is right, (H,); what is left is the share of motions that none
    tells."""
    shares = np.full(count, _OTHER_SHARE)
    if not is_first_doubted:
        shares[0] = _FIRST_SHARE
    none = _CARRIED_SHARE if is_left_alone else _NONE_SHARE
    return np.asarray((1.0 - none) * shares / shares.sum(), dtype=np.float64)


def log_likelihood(
    poses: Pose, guesses: Pose, shares: NDArray[np.float64], information: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    """(N,) of a motion to poses (N, 3), beside that to the first guess.

    A mixture of Student's t about guesses (H, 3) and a uniform density, since each source errs now and then,
    and all of them where a car slides or is carried: ``shares`` (H,) of it lie about the guesses with the
    ``information`` (3, 3), in the tangent frame of each; what is left is spread over ``reach`` metres to each
    side and all headings.
    """
    off = between(guesses[:, None], poses[None])
    squared = np.einsum("hni,ij,hnj->hn", off, information, off)
    usual = (1.0 + squared / _FREEDOM) ** (-0.5 * (_FREEDOM + 3.0))
    peak = _PEAK * np.sqrt(np.linalg.det(information))
    volume = (2.0 * reach) ** 2 * 2.0 * np.pi
    density = shares @ usual + (1.0 - shares.sum()) / (volume * peak)
    return np.asarray(np.log(density / shares[0]), dtype=np.float64)
