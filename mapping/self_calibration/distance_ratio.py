"""How far the wheels go when the scans go a metre, where the scans show how far that is.

Along a bare corridor scans show no motion, so only windows count in which surfaces face the direction of
travel. The ratio is the median over these, its deviation that of a bootstrap over windows [Efron and
Tibshirani, An Introduction to the Bootstrap, 1993]; scans that were followed wrongly make it scatter, and
then nothing is told. Distances need neither turns nor a known place of the laser.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.mount import MAX_TURN_DIFFERENCE
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import WheelTrack, Windows, motion_pairs, windows_of
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.sensing.scan import Scan

_GAP = 6.0
"""Times the distance of two neighbouring beams at which their returns are of one surface, because walls are
met aslant."""
_MIN_DISTANCE = 0.1
"""Metres that the scans must move in a window that counts; by judgement: ten times the noise of a track."""
_MIN_SHOWN = 0.15
"""Mean square of the cosine between surfaces' normals and the direction of travel from which scans show how
far they went. Measured: 0.1 in the barest corridor of a simulated building, 0.25 and more in rooms; nothing
changes between 0.1 and 0.3 there."""
_MIN_WINDOWS = 10
"""Windows that count, at least; by judgement: some five seconds of travel."""
_MAX_SPREAD = 1.3
"""Ratio of the upper and the lower quartile at most. Measured: up to 1.2 on 15 recordings whose scans were
followed rightly, 1.5 and more where they were not."""
_RESAMPLINGS = 100
"""Of the bootstrap; by judgement: they tell a deviation to 7 %."""
LEAST, _MOST = 0.84, 1.15
"""Ratios beyond which one of the two is wrong. Measured on recordings that are right: 0.87 to 1.05; the
mapper learns 10 % by itself, and with 20 % it bends a simulated building."""
_MIN_ALIGNMENT = 0.7
"""Mean agreement of the directions of travel below which wheels do not go where they look. Measured: 0.9 and
more where they do, 0.54 with x and y exchanged."""
_MIN_WINDOWS_OF_DIRECTION = 20
"""Windows for that, at least; by judgement: ten seconds of travel."""


@dataclass(frozen=True)
class DistanceRatio:
    """How the distances of the wheels relate to those of the scans."""

    value: float
    """Metres by the wheels for one by the scans."""
    sigma: float
    """Standard deviation."""
    windows: int
    """In which that was seen."""
    alignment: float
    """Length of the mean of the unit vectors of the wheels' direction of travel, relative to that of the
    scans: 1 where both differ by a constant, near 0 where they have nothing in common."""

    @property
    def is_wrong(self) -> bool:
        """Whether the two surely differ by more than wheels and scans that are right do."""
        low, high = self.value - 3.0 * self.sigma, self.value + 3.0 * self.sigma
        return high < LEAST or low > _MOST

    @property
    def contradicts_turns(self) -> bool:
        """Whether the wheels go as far as the scans, but not where their own yaw looks."""
        return (
            not self.is_wrong
            and self.alignment < _MIN_ALIGNMENT
            and self.windows >= _MIN_WINDOWS_OF_DIRECTION
        )


def distance_ratio(track: ScanTrack, wheels: WheelTrack, lag: int) -> DistanceRatio | None:
    """The ratio, for wheels that are stamped ``lag`` nanoseconds later than scans; None where the scans show
    too few distances, or the windows do not agree."""
    windows = windows_of(track)
    ratios, directions = [], []
    for begin, end in zip(windows.begins, windows.ends, strict=True):
        motions = motion_pairs(track, wheels, Windows(np.array([begin]), np.array([end])), lag)
        if len(motions.by_wheels) == 0:
            continue
        laser, base = motions.by_scans[0], motions.by_wheels[0]
        place = track.scans[begin].base_from_laser
        moved = compose(compose(place, laser), inverse(place))
        distance = float(np.hypot(moved[0], moved[1]))
        is_clear = distance > _MIN_DISTANCE and abs(laser[2] - base[2]) < MAX_TURN_DIFFERENCE
        if is_clear and _shown_along(track.scans[begin], laser) > _MIN_SHOWN:
            ratios.append(float(np.hypot(base[0], base[1])) / distance)
            directions.append(_direction(base) / _direction(moved))
    if len(ratios) < _MIN_WINDOWS:
        return None
    low, value, high = np.quantile(ratios, [0.25, 0.5, 0.75]).tolist()
    if high > _MAX_SPREAD * low:
        return None
    draws = np.random.default_rng(0).choice(np.array(ratios), (_RESAMPLINGS, len(ratios)))
    sigma = float(np.std(np.median(draws, axis=1)))
    return DistanceRatio(value, sigma, len(ratios), float(abs(np.mean(directions))))


def _direction(motion: Pose) -> complex:
    """Of length 1, of a motion (3,); 1 where there is none."""
    along = complex(motion[0], motion[1])
    return along / abs(along) if along else 1.0 + 0.0j


def _shown_along(scan: Scan, motion: Pose) -> float:
    """Mean square of the cosine between the normals of the surfaces in a scan and its motion (3,): about 0 in
    a bare corridor, 0.5 in a room."""
    normals = _normals(scan)
    along = motion[:2] / max(float(np.hypot(motion[0], motion[1])), 1e-9)
    return float(np.mean((normals @ along) ** 2)) if len(normals) else 0.0


def _normals(scan: Scan) -> NDArray[np.float64]:
    """(N, 2) of the surfaces between returns that are two degrees or more apart, in the laser's frame."""
    is_hit = np.isfinite(scan.ranges) & (scan.ranges > 0.0)
    bearings, ranges = scan.bearings[is_hit], scan.ranges[is_hit]
    apart = 2 * max(len(bearings) // 180, 1)  # so that noise does not tilt what is near
    if len(bearings) <= apart:
        return np.zeros((0, 2))
    points = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])
    steps = points[apart:] - points[:-apart]
    lengths = np.hypot(*steps.T)
    usual = apart * float(np.median(np.diff(bearings))) * ranges[:-apart]
    is_surface = (lengths > 1e-6) & (lengths < _GAP * usual)
    normals: NDArray[np.float64] = steps[is_surface, ::-1] / lengths[is_surface, None] * [-1.0, 1.0]
    return normals
