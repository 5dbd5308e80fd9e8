"""Rescale the bearings of scans whose field of view differs from what the driver states."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import wrap_angle
from racecar.sensors.scan import Scan


def scaled_bearings(scan: Scan, factor: float) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Bearings (M,) in ascending order and the indices (M,) of their beams; beams that would overlap others
    are removed.

    If the beams are symmetric, straight ahead is kept. Otherwise the first beam keeps its bearing, because
    drivers count from there.
    """
    bearings, beams = _continuous(scan)
    step = float(np.median(np.diff(bearings))) if len(bearings) > 1 else 0.0
    is_even = abs(float(bearings[0] + bearings[-1])) < 2.0 * step
    fixed = 0.0 if is_even else float(bearings[np.argmin(scan.time_offsets[beams])])
    scaled = np.asarray(wrap_angle(fixed + factor * (bearings - fixed)))
    order = np.argsort(scaled, kind="stable")
    order = order[np.diff(scaled[order], prepend=-np.inf) > 1e-9]
    return scaled[order], beams[order]


def _continuous(scan: Scan) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Unwrapped bearings (N,), without a jump where the sweep passes behind the laser, and beams (N,).

    Their middle is within half a turn; a full-turn sweep begins with its first beam in time.
    """
    gaps = np.diff(scan.bearings, append=scan.bearings[0] + 2.0 * np.pi)
    is_whole_turn = bool(gaps.max() < 1.5 * np.median(gaps))
    first = int(np.argmin(scan.time_offsets)) if is_whole_turn else (int(np.argmax(gaps)) + 1) % len(gaps)
    beams = np.roll(np.arange(len(gaps)), -first)
    bearings = np.unwrap(scan.bearings[beams])
    middle = 0.5 * float(bearings[0] + bearings[-1])
    return bearings + (float(wrap_angle(middle)) - middle), beams


def with_bearings_scaled(scan: Scan, factor: float) -> Scan:
    """The scan with rescaled bearings."""
    bearings, order = scaled_bearings(scan, factor)
    return replace(scan, bearings=bearings, ranges=scan.ranges[order], time_offsets=scan.time_offsets[order])
