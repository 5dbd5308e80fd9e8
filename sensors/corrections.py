"""Corrects what a recording states wrongly about its sensors, while it is read."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.findings import Finding
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scaled_bearings import scaled_bearings
from racecar.sensors.scan import Scan, frozen
from racecar.sensors.yaw_rate import YawRate


@dataclass(frozen=True, eq=False)
class Corrections:
    """Everything that is read differently from what the messages state."""

    beams_are_reversed: bool = False
    """Whether the beams were measured in reverse time order."""
    bearing_factor: float = 1.0
    """Ratio of true to stated angles of the first laser's beams."""
    base_from_laser: Pose | None = None
    """(3,) mount of the first laser, if it is not the one in the recording."""
    is_upside_down: bool = False
    """Whether the first laser is mounted the other way up than recorded: upside down, if upright."""
    scan_shift: int = 0
    """Nanoseconds to add to the stamps of scans."""
    odometry_shift: int = 0
    """Nanoseconds to add to the stamps of odometry."""
    yaw_rate_shift: int = 0
    """Nanoseconds to add to the stamps of yaw rates."""
    odometry_factors: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors for x, y and yaw of the odometry."""
    uses_odometry: bool = True
    """Whether the odometry is used at all."""
    findings: tuple[Finding, ...] = ()
    """The reasons for the corrections, and any other problems found."""

    @property
    def inputs(self) -> dict[str, object]:
        """The corrections to the recording, for reports."""
        changes: dict[str, object] = {
            "beams": "reversed" if self.beams_are_reversed else None,
            "bearing_factor": self.bearing_factor if self.bearing_factor != 1.0 else None,
            "laser_hangs_otherwise": self.is_upside_down or None,
            "scan_shift_s": self.scan_shift * 1e-9 or None,
            "odometry_shift_s": self.odometry_shift * 1e-9 or None,
            "yaw_rate_shift_s": self.yaw_rate_shift * 1e-9 or None,
            "odometry_factors": self.odometry_factors if self.odometry_factors != (1.0, 1.0, 1.0) else None,
            "odometry_left_out": None if self.uses_odometry else True,
        }
        made = {name: value for name, value in changes.items() if value is not None}
        return {"corrections": made} if made else {}


NO_CORRECTIONS = Corrections()


class Corrector:
    """Applies corrections to scans and odometry; arrays shared between scans are corrected once."""

    def __init__(self, corrections: Corrections) -> None:
        self._corrections = corrections
        self._factors = np.array(corrections.odometry_factors)
        self._changes_scans = (
            corrections.beams_are_reversed
            or corrections.is_upside_down
            or corrections.bearing_factor != 1.0
            or corrections.base_from_laser is not None
            or corrections.scan_shift != 0
        )
        self._changes_odometry = corrections.odometry_shift != 0 or bool(np.any(self._factors != 1.0))
        self._beams: dict[int, _Beams] = {}
        """The latest beams of each laser."""

    def correct(self, item: Measurement) -> Measurement:
        """The corrected scan or sample."""
        if isinstance(item, Scan):
            return self.scan(item)
        return self.odometry(item) if isinstance(item, Odometry) else self.yaw_rate(item)

    def scan(self, scan: Scan) -> Scan:
        """The corrected scan."""
        corrections = self._corrections
        if not self._changes_scans:
            return scan
        is_first = scan.laser == 0
        is_mirrored = corrections.is_upside_down and is_first
        beams = self._beams.get(scan.laser)
        if beams is None or not beams.are_those_of(scan):
            factor = corrections.bearing_factor if is_first else 1.0
            beams = self._beams[scan.laser] = self._corrected_beams(scan, factor, is_mirrored=is_mirrored)
        place = corrections.base_from_laser
        return replace(
            scan,
            stamp=scan.stamp + corrections.scan_shift,
            bearings=beams.bearings,
            ranges=scan.ranges if beams.order is None else scan.ranges[beams.order],
            time_offsets=beams.time_offsets,
            base_from_laser=scan.base_from_laser if place is None or not is_first else place,
        )

    def odometry(self, odometry: Odometry) -> Odometry:
        """The corrected sample."""
        if not self._changes_odometry:
            return odometry
        return Odometry(
            odometry.stamp + self._corrections.odometry_shift,
            odometry.odom_from_base * self._factors,
            odometry.twist * self._factors,
        )

    def yaw_rate(self, yaw_rate: YawRate) -> YawRate:
        """The corrected sample."""
        shift = self._corrections.yaw_rate_shift
        return YawRate(yaw_rate.stamp + shift, yaw_rate.rate) if shift else yaw_rate

    def _corrected_beams(self, scan: Scan, factor: float, *, is_mirrored: bool) -> "_Beams":
        bearings, offsets, order = scan.bearings, scan.time_offsets, np.arange(len(scan.bearings))
        if factor != 1.0:
            bearings, order = scaled_bearings(scan, factor)
            offsets = offsets[order]
        if self._corrections.beams_are_reversed:
            # After a stamp the order is reversed; before it, time_increment has the wrong sign.
            is_sign = scan.cloud is None and offsets.max() <= 0.0
            offsets = -offsets if is_sign else offsets.min() + offsets.max() - offsets
        if is_mirrored:
            bearings, offsets, order = -bearings[::-1], offsets[::-1], order[::-1]
        is_other = is_mirrored or factor != 1.0
        return _Beams(
            scan.bearings,
            scan.time_offsets,
            frozen(bearings.copy()),
            frozen(offsets.copy()),
            order if is_other else None,
        )


@dataclass(frozen=True, eq=False)
class _Beams:
    """Bearings and times shared by many scans, as recorded and corrected."""

    recorded_bearings: NDArray[np.float64]
    recorded_offsets: NDArray[np.float64]
    bearings: NDArray[np.float64]
    time_offsets: NDArray[np.float64]
    order: NDArray[np.intp] | None
    """Indices of the recorded beams in the corrected order; None if unchanged."""

    def are_those_of(self, scan: Scan) -> bool:
        return self.recorded_bearings is scan.bearings and self.recorded_offsets is scan.time_offsets
