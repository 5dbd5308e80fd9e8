"""Prior probability of a motion before scan matching: close to one of several guesses, or anywhere."""

from math import gamma

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between

_FIRST_SHARE = 0.95
"""Probability that the first guess, usually the wheels', is right, relative to this plus `_OTHER_SHARE` for
each further guess. Chosen by judgement: wheels slip now and then."""
_OTHER_SHARE = 0.005
"""The same for each further guess, and for the first where wheels repeat one pose to the last bit, as from a
hanging driver. Chosen by judgement: along an arc or a bare corridor scans fit nearly everywhere."""
_NONE_SHARE = 0.003
"""Probability that no guess is right. Chosen by judgement: wheels slip or report nonsense."""
_CARRIED_SHARE = 0.3
"""The same after a gap in which the car stood, since it may have been carried."""
_FREEDOM = 3.0
"""Degrees of freedom of Student's t, since wheels err by many standard deviations now and then. Chosen by
judgement: the fewest with a variance."""
_PEAK = gamma(0.5 * (_FREEDOM + 3.0)) / (gamma(0.5 * _FREEDOM) * (_FREEDOM * np.pi) ** 1.5)
"""Peak density of Student's t in three dimensions, in normalized units (Kotz and Nadarajah, 2004)."""


def guess_shares(count: int, *, is_first_doubted: bool, is_left_alone: bool) -> NDArray[np.float64]:
    """(H,) probability of each of ``count`` guesses; the remainder is that of a motion none of them
    predicts."""
    shares = np.full(count, _OTHER_SHARE)
    if not is_first_doubted:
        shares[0] = _FIRST_SHARE
    none = _CARRIED_SHARE if is_left_alone else _NONE_SHARE
    return np.asarray((1.0 - none) * shares / shares.sum(), dtype=np.float64)


def log_likelihood(
    poses: Pose, guesses: Pose, shares: NDArray[np.float64], information: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    """(N,) log-likelihood of a motion to poses (N, 3), relative to that to the first guess.

    A mixture of Student's t around guesses (H, 3) and a uniform density, since each source errs now and then,
    and all of them do where a car slides or is carried. ``shares`` (H,) are the weights of the guesses, with
    ``information`` (3, 3) in the tangent frame of each. The remainder is uniform over ``reach`` metres to
    each side and all headings.
    """
    off = between(guesses[:, None], poses[None])
    squared = np.einsum("hni,ij,hnj->hn", off, information, off)
    usual = (1.0 + squared / _FREEDOM) ** (-0.5 * (_FREEDOM + 3.0))
    peak = _PEAK * np.sqrt(np.linalg.det(information))
    volume = (2.0 * reach) ** 2 * 2.0 * np.pi
    density = shares @ usual + (1.0 - shares.sum()) / (volume * peak)
    return np.asarray(np.log(density / shares[0]), dtype=np.float64)
