"""How far the wheels go when the scans go a metre, where the scans show how far that is.

Along a bare corridor scans show no motion, so only windows count in which surfaces face the direction of
travel. The ratio is the median over these, its deviation that of a bootstrap over windows [Efron and
Tibshirani, An Introduction to the Bootstrap, 1993]; scans that were followed wrongly make it scatter, and
then nothing is told. Distances need neither turns nor a known place of the laser.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.config import DistanceRatioConfig, SelfCalibrationConfig
from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import WheelTrack, Windows, motion_pairs, windows_of
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.sensing.scan import Scan

_GAP = 6.0
"""Times the distance of two neighbouring beams at which their returns are of one surface, because walls are
met aslant."""


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

    def is_wrong(self, config: DistanceRatioConfig) -> bool:
        """Whether the two surely differ by more than wheels and scans that are right do."""
        low, high = self.value - 3.0 * self.sigma, self.value + 3.0 * self.sigma
        return high < config.least or low > config.most

    def contradicts_turns(self, config: DistanceRatioConfig) -> bool:
        """Whether the wheels go as far as the scans, but not where their own yaw looks."""
        return (
            not self.is_wrong(config)
            and self.alignment < config.min_alignment
            and self.windows >= config.min_windows_of_direction
        )


def distance_ratio(
    track: ScanTrack, wheels: WheelTrack, lag: int, config: SelfCalibrationConfig
) -> DistanceRatio | None:
    """The ratio, for wheels that are stamped ``lag`` nanoseconds later than scans; None where the scans show
    too few distances, or the windows do not agree."""
    distances, windows = config.distances, windows_of(track, config.window)
    ratios, directions = [], []
    for begin, end in zip(windows.begins, windows.ends, strict=True):
        motions = motion_pairs(track, wheels, Windows(np.array([begin]), np.array([end])), lag)
        if len(motions.by_wheels) == 0:
            continue
        laser, base = motions.by_scans[0], motions.by_wheels[0]
        place = track.scans[begin].base_from_laser
        moved = compose(compose(place, laser), inverse(place))
        distance = float(np.hypot(moved[0], moved[1]))
        is_clear = (
            distance > distances.min_distance and abs(laser[2] - base[2]) < distances.max_turn_difference
        )
        if is_clear and _shown_along(track.scans[begin], laser) > distances.min_shown:
            ratios.append(float(np.hypot(base[0], base[1])) / distance)
            directions.append(_direction(base) / _direction(moved))
    if len(ratios) < distances.min_windows:
        return None
    low, value, high = np.quantile(ratios, [0.25, 0.5, 0.75]).tolist()
    if high > distances.max_spread * low:
        return None
    draws = np.random.default_rng(0).choice(np.array(ratios), (distances.resamplings, len(ratios)))
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
