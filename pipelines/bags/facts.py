"""What is learned of scans and odometry while they are read, and what of it is suspicious."""

from dataclasses import dataclass, field

import numpy as np

from racecar.sensors.even_sample import EvenSample
from racecar.sensors.findings import Finding, times
from racecar.sensors.odometry import Odometry, is_jump
from racecar.sensors.scan import FARTHEST_APART, Scan
from racecar.sensors.yaw_rate import YawRate

_LONGEST_STEP = 0.3
"""Metres between two samples of odometry, over which a car can steer without being seen to: by judgement."""
_OFTEN = 20.0
"""Samples of odometry a second that are enough at any speed, as the course asks for."""
_SPEED_SPAN = 200_000_000
"""Nanoseconds over which a speed is measured at least: stamps of single samples may jitter by their step."""
_INVALID_SHARE = 0.9
"""Of the beams, above which the sensor is covered rather than in the open. Neato lasers say nothing of three
quarters of their beams in a large room, and maps of theirs are right."""
_LONG_BLANK = 1.0
"""Seconds without a return; what is shorter is bridged without a trace, by judgement."""
_STANDS = 0.05
"""Metres per second below which a car stands, but for the noise of its odometry: by judgement."""
_FAR_APART = 0.5
"""Metres driven from scan to scan, from which they share too little to correct the wheels well. Measured:
aces with a scan every two seconds, which is 0.9 m, maps to 0.10 m, with all of them to 0.035 m."""
_WALKING = 1.0
"""m/s that a car drives of which nothing tells how fast: as people walk, by judgement."""
_UNEVEN = 1.5
"""Usual step between scans over the shortest ones, from which scans are missing: one that is doubles a step,
and stamps jitter by less. By judgement."""
_SWEEPS = 1.75
"""Sweeps from scan to scan below which none is missing in between: lasers turn for 1 to 1.5 sweeps per scan,
and with one missing for 2 at least."""
_FEW_SAMPLES = 50
"""Samples of a gyroscope that may be equal by chance, where one is read coarsely: by judgement."""
_MOST_STEPS = 20_000
"""Between stamps that are kept, for their median: by judgement."""


class Spacing:
    """Steps between stamps."""

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        self.count = 0
        self._steps = EvenSample[int](_MOST_STEPS)

    def add(self, stamp: int) -> None:
        """Take note of the next stamp, in nanoseconds."""
        if self.last is not None:
            self._steps.add(stamp - self.last)
        self.first = stamp if self.first is None else self.first
        self.last = stamp
        self.count += 1

    @property
    def seconds(self) -> float:
        """From the first stamp to the last."""
        return 0.0 if self.first is None or self.last is None else (self.last - self.first) * 1e-9

    @property
    def rate(self) -> float:
        """Messages per second by the median step; 0 where there are fewer than two."""
        return 1e9 / float(np.median(self._steps.values)) if self._steps.values else 0.0

    @property
    def shortest(self) -> float:
        """Seconds that a tenth of the steps do not exceed; 0 where there are none."""
        return float(np.quantile(self._steps.values, 0.1)) * 1e-9 if self._steps.values else 0.0


@dataclass
class ScanFacts:
    """Of all scans so far."""

    spacing: Spacing = field(default_factory=Spacing)
    """Of the first laser, where there are several."""
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
    """Scans of which no beam met anything."""
    longest_blank: float = 0.0
    """Seconds."""
    _blank_since: int | None = None

    def add(self, scan: Scan) -> None:
        """Take note of the next scan."""
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
        """What a person should know of."""
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
    """Of all odometry so far."""

    spacing: Spacing = field(default_factory=Spacing)
    path_length: float = 0.0
    turned: float = 0.0
    driven_seconds: float = 0.0
    top_speed: float = 0.0
    jumps: int = 0
    last: Odometry | None = None
    _span_begin: Odometry | None = None

    def add(self, odometry: Odometry) -> None:
        """Take note of the next sample."""
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
        """What a person should know of."""
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
    """Where the car drives far from one scan to the next, or may, since no odometry follows it."""
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
    """Of all yaw rates so far."""

    spacing: Spacing = field(default_factory=Spacing)
    slowest: float = np.inf
    fastest: float = -np.inf
    """Radians per second."""
    turns_elsewhere: int = 0
    """Samples without yaw that turn about another axis."""

    def add(self, yaw_rate: YawRate) -> None:
        """Take note of the next sample."""
        self.spacing.add(yaw_rate.stamp)
        self.slowest, self.fastest = min(self.slowest, yaw_rate.rate), max(self.fastest, yaw_rate.rate)

    @property
    def fastest_turn(self) -> float:
        """Radians per second, to either side; 0 without any sample."""
        return max(abs(self.slowest), abs(self.fastest)) if self.spacing.count else 0.0

    @property
    def findings(self) -> list[Finding]:
        """What a person should know of."""
        if self.spacing.count < _FEW_SAMPLES or self.slowest != self.fastest:
            return []
        is_on_its_side = self.turns_elsewhere > _FEW_SAMPLES
        return [Finding("gyroscope_on_its_side" if is_on_its_side else "gyroscope_dead", rate=self.slowest)]
