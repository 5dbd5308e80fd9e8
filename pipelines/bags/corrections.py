"""What a recording states wrongly about its sensors, put right while it is read."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.converters.shared_arrays import frozen
from racecar.pipelines.bags.findings import Finding


@dataclass(frozen=True, eq=False)
class Corrections:
    """All that is to be read otherwise than it stands in the messages."""

    beams_are_reversed: bool = False
    """Whether the beams were measured in the opposite order of time."""
    base_from_laser: Pose | None = None
    """(3,) the place of the first laser, where it is not the one that the recording tells."""
    is_upside_down: bool = False
    """Whether the first laser hangs upside down, which the recording does not tell."""
    scan_shift: int = 0
    """Nanoseconds to add to the stamps of scans."""
    odometry_shift: int = 0
    """Nanoseconds to add to the stamps of odometry."""
    odometry_factors: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """By which x, y and yaw of the odometry are multiplied."""
    uses_odometry: bool = True
    """Whether the odometry is worth reading."""
    findings: tuple[Finding, ...] = ()
    """Why all this is done, and what else was noticed."""

    @property
    def inputs(self) -> dict[str, object]:
        """How the recording is read otherwise than it stands there, for reports."""
        changes: dict[str, object] = {
            "beams": "reversed" if self.beams_are_reversed else None,
            "laser_is_upside_down": self.is_upside_down or None,
            "scan_shift_s": self.scan_shift * 1e-9 or None,
            "odometry_shift_s": self.odometry_shift * 1e-9 or None,
            "odometry_factors": self.odometry_factors if self.odometry_factors != (1.0, 1.0, 1.0) else None,
            "odometry_left_out": None if self.uses_odometry else True,
        }
        made = {name: value for name, value in changes.items() if value is not None}
        return {"corrections": made} if made else {}


NO_CORRECTIONS = Corrections()


class Corrector:
    """Applies corrections to scans and odometry; arrays that scans share are corrected once."""

    def __init__(self, corrections: Corrections) -> None:
        self._corrections = corrections
        self._factors = np.array(corrections.odometry_factors)
        self._changes_scans = (
            corrections.beams_are_reversed
            or corrections.is_upside_down
            or corrections.base_from_laser is not None
            or corrections.scan_shift != 0
        )
        self._changes_odometry = corrections.odometry_shift != 0 or bool(np.any(self._factors != 1.0))
        self._beams: dict[int, _Beams] = {}
        """The latest of each laser."""

    def correct(self, item: Measurement) -> Measurement:
        """The scan, or the sample, as it was."""
        if isinstance(item, Scan):
            return self.scan(item)
        return self.odometry(item) if isinstance(item, Odometry) else item

    def scan(self, scan: Scan) -> Scan:
        """The scan as it was."""
        corrections = self._corrections
        if not self._changes_scans:
            return scan
        is_first = scan.laser == 0
        is_mirrored = corrections.is_upside_down and is_first
        beams = self._beams.get(scan.laser)
        if beams is None or not beams.are_those_of(scan):
            beams = self._beams[scan.laser] = self._corrected_beams(scan, is_mirrored=is_mirrored)
        place = corrections.base_from_laser
        return replace(
            scan,
            stamp=scan.stamp + corrections.scan_shift,
            bearings=beams.bearings,
            ranges=scan.ranges[::-1] if is_mirrored else scan.ranges,
            time_offsets=beams.time_offsets,
            base_from_laser=scan.base_from_laser if place is None or not is_first else place,
        )

    def odometry(self, odometry: Odometry) -> Odometry:
        """The sample as it was."""
        if not self._changes_odometry:
            return odometry
        return Odometry(
            odometry.stamp + self._corrections.odometry_shift,
            odometry.odom_from_base * self._factors,
            odometry.twist * self._factors,
        )

    def _corrected_beams(self, scan: Scan, *, is_mirrored: bool) -> "_Beams":
        bearings, offsets = scan.bearings, scan.time_offsets
        if self._corrections.beams_are_reversed:
            offsets = offsets.min() + offsets.max() - offsets
        if is_mirrored:
            bearings, offsets = -bearings[::-1], offsets[::-1]
        return _Beams(scan.bearings, scan.time_offsets, frozen(bearings.copy()), frozen(offsets.copy()))


@dataclass(frozen=True, eq=False)
class _Beams:
    """Bearings and times that many scans share, as they were and corrected."""

    recorded_bearings: NDArray[np.float64]
    recorded_offsets: NDArray[np.float64]
    bearings: NDArray[np.float64]
    time_offsets: NDArray[np.float64]

    def are_those_of(self, scan: Scan) -> bool:
        return self.recorded_bearings is scan.bearings and self.recorded_offsets is scan.time_offsets
