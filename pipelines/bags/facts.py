"""Statistics of scans and odometry gathered while reading, and findings about what is suspicious."""

from dataclasses import dataclass, field

import numpy as np

from racecar.sensors.even_sample import EvenSample
from racecar.sensors.findings import Finding, times
from racecar.sensors.odometry import Odometry, is_jump
from racecar.sensors.scan import FARTHEST_APART, Scan
from racecar.sensors.yaw_rate import YawRate

_LONGEST_STEP = 0.3
"""Metres between two odometry samples over which a car can steer unseen. Chosen by judgement."""
_OFTEN = 20.0
"""Odometry samples per second that suffice at any speed, as required by the course."""
_SPEED_SPAN = 200_000_000
"""Least nanoseconds over which a speed is measured; stamps of single samples may jitter by their step."""
_INVALID_SHARE = 0.9
"""Share of invalid beams above which the sensor is covered instead of in the open. Neato lasers report
nothing for three quarters of their beams in a large room, and their maps are right."""
_LONG_BLANK = 1.0
"""Seconds without a return; shorter blanks are bridged without harm. Chosen by judgement."""
_STANDS = 0.05
"""Speed in m/s below which a car stands, apart from odometry noise. Chosen by judgement."""
_FAR_APART = 0.5
"""Metres driven between scans from which they overlap too little to correct the wheels well. Measured: aces
with a scan every two seconds, which is 0.9 m, maps to 0.10 m, and with all scans to 0.035 m."""
_WALKING = 1.0
"""Assumed speed in m/s if nothing measures it: walking pace, chosen by judgement."""
_UNEVEN = 1.5
"""Ratio of the usual step between scans to the shortest ones from which scans are missing. A missing scan
doubles a step, and stamps jitter by less. Chosen by judgement."""
_SWEEPS = 1.75
"""Sweeps per scan below which no scan is missing. Lasers turn 1 to 1.5 times per scan, and at least 2 times
if one is missing."""
_FEW_SAMPLES = 50
"""Gyroscope samples that may be equal by chance if its resolution is coarse. Chosen by judgement."""
_MOST_STEPS = 20_000
"""Most steps between stamps that are kept for their median. Chosen by judgement."""


class Spacing:
    """Statistics of the steps between stamps."""

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        self.count = 0
        self._steps = EvenSample[int](_MOST_STEPS)

    def add(self, stamp: int) -> None:
        """Add the next stamp in nanoseconds."""
        if self.last is not None:
            self._steps.add(stamp - self.last)
        self.first = stamp if self.first is None else self.first
        self.last = stamp
        self.count += 1

    @property
    def seconds(self) -> float:
        """Seconds from first to last stamp."""
        return 0.0 if self.first is None or self.last is None else (self.last - self.first) * 1e-9

    @property
    def rate(self) -> float:
        """Messages per second, from the median step; 0 if there are fewer than two."""
        return 1e9 / float(np.median(self._steps.values)) if self._steps.values else 0.0

    @property
    def shortest(self) -> float:
        """Tenth percentile of the steps in seconds; 0 if there are none."""
        return float(np.quantile(self._steps.values, 0.1)) * 1e-9 if self._steps.values else 0.0


@dataclass
class ScanFacts:
    """Statistics of all scans so far."""

    spacing: Spacing = field(default_factory=Spacing)
    """Spacing of the first laser, if there are several."""
    count: int = 0
    fewest_beams: int = 2**31
    most_beams: int = 0
    first_bearing: float = np.inf
    last_bearing: float = -np.inf
    beam_spacing: float = np.inf
    """Radians between neighbouring beams of a planar sensor, in the densest scan."""
    longest_sweep: float = 0.0
    max_range: float = 0.0
    nearest: float = np.inf
    farthest: float = 0.0
    beams: int = 0
    misses: int = 0
    invalid: int = 0
    blank: int = 0
    """Scans in which no beam hit anything."""
    longest_blank: float = 0.0
    """Seconds."""
    _blank_since: int | None = None

    def add(self, scan: Scan) -> None:
        """Add the next scan."""
        self.count += 1
        if scan.laser == 0:
            self.spacing.add(scan.stamp)
        beams = len(scan.ranges)
        self.fewest_beams, self.most_beams = min(self.fewest_beams, beams), max(self.most_beams, beams)
        self.first_bearing = min(self.first_bearing, float(scan.bearings[0]))
        self.last_bearing = max(self.last_bearing, float(scan.bearings[-1]))
        if scan.cloud is None and beams > 1:
            span = float(scan.bearings[-1] - scan.bearings[0])
            self.beam_spacing = min(self.beam_spacing, span / (beams - 1))
        elif scan.cloud is not None:
            self.beam_spacing = 0.0
        self.longest_sweep = max(self.longest_sweep, float(np.ptp(scan.time_offsets)))
        self.max_range = max(self.max_range, scan.max_range)
        returns = scan.ranges[scan.is_return]
        if len(returns):
            self.nearest = min(self.nearest, float(returns.min()))
            self.farthest = max(self.farthest, float(returns.max()))
        self._note_blank(scan.stamp, is_blank=len(returns) == 0)
        misses = int(np.count_nonzero(np.isposinf(scan.ranges)))
        self.beams += beams
        self.misses += misses
        self.invalid += beams - len(returns) - misses

    def _note_blank(self, stamp: int, *, is_blank: bool) -> None:
        if self._blank_since is not None:
            self.longest_blank = max(self.longest_blank, (stamp - self._blank_since) * 1e-9)
        self.blank += is_blank
        if not is_blank:
            self._blank_since = None
        elif self._blank_since is None:
            self._blank_since = stamp

    @property
    def findings(self) -> list[Finding]:
        """Findings for the user."""
        if not self.spacing.count:
            return []
        findings = []
        if np.isfinite(self.beam_spacing) and self.beam_spacing > FARTHEST_APART:
            findings.append(
                Finding(
                    "beams_too_few",
                    spoils_map=True,
                    beams=self.most_beams,
                    apart=np.degrees(self.beam_spacing),
                    enough=np.degrees(FARTHEST_APART),
                )
            )
        if self.longest_blank > _LONG_BLANK and self.farthest > 0.0:
            findings.append(
                Finding("scans_blank", count=self.blank, scans=self.count, seconds=self.longest_blank)
            )
        if self.invalid > _INVALID_SHARE * self.beams:
            findings.append(Finding("beams_without_reading", share=self.invalid / self.beams))
        if self.farthest == 0.0:
            findings.append(Finding("nothing_seen", spoils_map=True))
        return findings


@dataclass
class OdometryFacts:
    """Statistics of all odometry so far."""

    spacing: Spacing = field(default_factory=Spacing)
    path_length: float = 0.0
    turned: float = 0.0
    driven_seconds: float = 0.0
    top_speed: float = 0.0
    jumps: int = 0
    last: Odometry | None = None
    _span_begin: Odometry | None = None

    def add(self, odometry: Odometry) -> None:
        """Add the next sample."""
        self.spacing.add(odometry.stamp)
        if self._span_begin is None:
            self._span_begin = odometry
        if self.last is not None:
            step = odometry.odom_from_base - self.last.odom_from_base
            metres = float(np.hypot(step[0], step[1]))
            seconds = (odometry.stamp - self.last.stamp) * 1e-9
            if is_jump(self.last.odom_from_base, odometry.odom_from_base, seconds):
                self.jumps += 1
                self._span_begin = odometry
            else:
                self.path_length += metres
                self.driven_seconds += seconds if metres > _STANDS * seconds else 0.0
                self._measure_speed(self._span_begin, odometry)
            self.turned += abs(float(np.arctan2(np.sin(step[2]), np.cos(step[2]))))
        self.last = odometry

    def _measure_speed(self, begin: Odometry, end: Odometry) -> None:
        if end.stamp - begin.stamp >= _SPEED_SPAN:
            metres = float(np.hypot(*(end.odom_from_base - begin.odom_from_base)[:2]))
            self.top_speed = max(self.top_speed, metres / ((end.stamp - begin.stamp) * 1e-9))
            self._span_begin = end

    @property
    def findings(self) -> list[Finding]:
        """Findings for the user."""
        if not self.spacing.count:
            return []
        findings = []
        if self.jumps:
            findings.append(Finding("odometry_jumps", times=times(self.jumps)))
        rate = self.spacing.rate
        if rate < _OFTEN and self.top_speed > _LONGEST_STEP * rate:
            findings.append(Finding("odometry_rare", rate=rate, speed=self.top_speed))
        return findings


def findings_of_rare_scans(scans: ScanFacts, odometry: OdometryFacts) -> list[Finding]:
    """Finding if the car drives far between scans, or may do so because there is no odometry."""
    if not scans.spacing.rate or (odometry.spacing.count and not odometry.driven_seconds):
        return []
    seconds = 1.0 / scans.spacing.rate
    speed = odometry.path_length / odometry.driven_seconds if odometry.spacing.count else _WALKING
    if seconds * speed < _FAR_APART:
        return []
    shortest = scans.spacing.shortest
    return [
        Finding(
            "scans_rare",
            seconds=seconds,
            metres=seconds * speed if odometry.spacing.count else None,
            speed=_FAR_APART / seconds,
            shortest=shortest,
            are_some_lost=seconds > _UNEVEN * shortest,
            are_all=seconds < _SWEEPS * scans.longest_sweep,
        )
    ]


@dataclass
class YawRateFacts:
    """Statistics of all yaw rates so far."""

    spacing: Spacing = field(default_factory=Spacing)
    slowest: float = np.inf
    fastest: float = -np.inf
    """Radians per second."""
    turns_elsewhere: int = 0
    """Samples with zero yaw rate that turn about another axis."""

    def add(self, yaw_rate: YawRate) -> None:
        """Add the next sample."""
        self.spacing.add(yaw_rate.stamp)
        self.slowest, self.fastest = min(self.slowest, yaw_rate.rate), max(self.fastest, yaw_rate.rate)

    @property
    def fastest_turn(self) -> float:
        """Radians per second in either direction; 0 without samples."""
        return max(abs(self.slowest), abs(self.fastest)) if self.spacing.count else 0.0

    @property
    def findings(self) -> list[Finding]:
        """Findings for the user."""
        if self.spacing.count < _FEW_SAMPLES or self.slowest != self.fastest:
            return []
        is_on_its_side = self.turns_elsewhere > _FEW_SAMPLES
        return [Finding("gyroscope_on_its_side" if is_on_its_side else "gyroscope_dead", rate=self.slowest)]
