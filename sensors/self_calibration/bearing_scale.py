"""Detect a wrong angle increment from bent walls and mismatched turns.

A recording whose increment is off by a factor, and matches its ``angle_max``, looks consistent. But straight
walls are bent in it, and its scans turn too little or too much, by the same factor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.turn_agreement import TurnAgreement
from racecar.sensors.self_calibration.wall_straightness import WallStraightness

_USUAL_SPANS = np.radians([360.0, 270.0, 240.0, 180.0])
"""Fields of view of most lasers, so that a factor known from walls to some per cent is made exact."""
_SAME_SPAN = 0.04
"""Relative tolerance of a field of view: walls show a factor to 2 %, measured on 15 recordings."""
_OTHER_UNITS = 5.0
"""Factor beyond which a turn does not count, because it is in other units."""
_RIGHT_FACTOR = 1.2
"""Factor within which bearings are accepted as stated. Measured on 30 recordings: walls that agree say 0.94
to 1.03."""
_AGREED_FACTOR = 1.1
"""The same where wheels, gyroscope and walls all agree that bearings are wrong. Measured: wheels and
gyroscope of simulated cars turn as the scans within 1.04, walls as above."""
_CLOSE_AGREEMENT = 1.05
"""Factor by which these may then differ. Measured with angles stated 1.2 times as wide: 1.01."""
_AGREEMENT = 1.15
"""Factor by which walls and turns may differ and still agree. Measured on a simulated drive with stated
angles half as wide: 1.04."""


@dataclass(frozen=True)
class BearingScale:
    """Scale error of a laser's bearings."""

    factor: float
    """True angles relative to stated ones."""
    is_certain: bool
    """Whether walls and turns both show it."""


def bearing_scale(
    walls: WallStraightness | None, turns: Sequence[TurnAgreement], scan: Scan
) -> BearingScale | None:
    """Estimate from walls and the turns of other sensors; None where the angles seem right.

    Bent walls with matching turns are no fault: walls of round rooms suggest smaller angles. Without turns,
    only larger angles are accepted, as no place has walls that bulge everywhere. A factor near 1 is accepted
    only where walls, wheels and gyroscope all show it.
    """
    turns = [each for each in turns if 1.0 / _OTHER_UNITS < abs(each.ratio) < _OTHER_UNITS]
    if walls is None:
        factors = [1.0 / abs(each.ratio) for each in turns if each.is_scaled]
        agree = len(factors) > 1 and max(factors) < _AGREEMENT * min(factors)
        return BearingScale(float(np.mean(factors)), is_certain=False) if agree else None
    if _do_all_agree(walls.factor, turns):
        return BearingScale(_usual(walls.factor, scan), is_certain=True)
    if _apart(walls.factor, 1.0) < _RIGHT_FACTOR:
        return None
    if not turns:
        if walls.factor < 1.0:
            return None
        return BearingScale(_usual(walls.factor, scan), is_certain=False)
    if any(_apart(walls.factor, 1.0 / abs(each.ratio)) < _AGREEMENT for each in turns):
        return BearingScale(_usual(walls.factor, scan), is_certain=True)
    return None


def _do_all_agree(by_walls: float, turns: Sequence[TurnAgreement]) -> bool:
    """Whether two other sensors and the walls show nearly the same factor."""
    factors = [by_walls, *(1.0 / abs(each.ratio) for each in turns)]
    is_sure = any(each.is_beyond(_AGREED_FACTOR) for each in turns)
    are_off = all(_apart(factor, 1.0) > _AGREED_FACTOR for factor in factors)
    agree = max(factors) < _CLOSE_AGREEMENT * min(factors)
    return len(turns) > 1 and is_sure and are_off and agree


def _apart(factor: float, other: float) -> float:
    """Ratio of two factors, at least 1."""
    return max(factor / other, other / factor)


def _usual(factor: float, scan: Scan) -> float:
    """The factor that gives a scan a usual field of view, if nearly the same; else the factor itself."""
    step, count = float(np.median(np.diff(scan.bearings))), len(scan.bearings)
    spans = step * np.array(
        [count, *[count - 1] * (len(_USUAL_SPANS) - 1)]
    )  # a full turn ends where it began
    usual = _USUAL_SPANS / spans
    nearest = float(usual[np.argmin(np.abs(np.log(usual / factor)))])
    return nearest if _apart(nearest, factor) < 1.0 + _SAME_SPAN else factor
