"""What is in a bag, and what is wrong with it, before hours are spent on it."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import Odometry, is_jump
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.findings import Finding
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.bags.storage.chunks import BagTopic

_LEAST_PATH = 0.5
"""Metres; a car that was recorded for a map has gone farther, by judgement."""
_LOWEST_ODOMETRY_RATE = 10.0
"""Per second; below, a car at 1 m/s goes 0.1 m between two samples and may steer meanwhile: by judgement."""
_INVALID_SHARE = 0.5
"""Of the beams, above which the sensor is covered rather than in the open: by judgement."""
_MISSING_SHARE = 0.02
"""Of the steps between scans, above which they come unevenly: by judgement."""


class _Spacing:
    """Steps between stamps; of a long log, a sample of bounded size."""

    def __init__(self) -> None:
        self.first: int | None = None
        self.last: int | None = None
        self.count = 0
        self._steps: list[int] = []
        self._stride = 1

    def add(self, stamp: int) -> None:
        if self.last is not None and self.count % self._stride == 0:
            self._steps.append(stamp - self.last)
            if len(self._steps) >= 20_000:
                self._steps, self._stride = self._steps[::2], self._stride * 2
        self.first = stamp if self.first is None else self.first
        self.last = stamp
        self.count += 1

    @property
    def seconds(self) -> float:
        return 0.0 if self.first is None or self.last is None else (self.last - self.first) * 1e-9

    @property
    def rate(self) -> float:
        """Messages per second by the median step; 0 where there are fewer than two."""
        return 1e9 / float(np.median(self._steps)) if self._steps else 0.0

    @property
    def missing_share(self) -> float:
        """Share of the steps over which at least one message is missing."""
        steps = np.array(self._steps)
        return float(np.mean(steps > 1.7 * np.median(steps))) if len(steps) else 0.0


@dataclass
class _ScanFacts:
    spacing: _Spacing = field(default_factory=_Spacing)
    fewest_beams: int = 2**31
    most_beams: int = 0
    first_bearing: float = np.inf
    last_bearing: float = -np.inf
    longest_sweep: float = 0.0
    max_range: float = 0.0
    nearest: float = np.inf
    farthest: float = 0.0
    beams: int = 0
    misses: int = 0
    invalid: int = 0

    def add(self, scan: Scan) -> None:
        self.spacing.add(scan.stamp)
        beams = len(scan.ranges)
        self.fewest_beams, self.most_beams = min(self.fewest_beams, beams), max(self.most_beams, beams)
        self.first_bearing = min(self.first_bearing, float(scan.bearings[0]))
        self.last_bearing = max(self.last_bearing, float(scan.bearings[-1]))
        self.longest_sweep = max(self.longest_sweep, float(np.ptp(scan.time_offsets)))
        self.max_range = max(self.max_range, scan.max_range)
        returns = scan.ranges[scan.is_return]
        if len(returns):
            self.nearest = min(self.nearest, float(returns.min()))
            self.farthest = max(self.farthest, float(returns.max()))
        misses = int(np.count_nonzero(np.isposinf(scan.ranges)))
        self.beams += beams
        self.misses += misses
        self.invalid += beams - len(returns) - misses


@dataclass
class _OdometryFacts:
    spacing: _Spacing = field(default_factory=_Spacing)
    path_length: float = 0.0
    turned: float = 0.0
    top_speed: float = 0.0
    jumps: int = 0
    last: Odometry | None = None

    def add(self, odometry: Odometry) -> None:
        self.spacing.add(odometry.stamp)
        if self.last is not None:
            step = odometry.odom_from_base - self.last.odom_from_base
            metres = float(np.hypot(step[0], step[1]))
            seconds = (odometry.stamp - self.last.stamp) * 1e-9
            if is_jump(self.last.odom_from_base, odometry.odom_from_base, seconds):
                self.jumps += 1
            else:
                self.path_length += metres
                self.top_speed = max(self.top_speed, metres / seconds if seconds > 0.005 else 0.0)
            self.turned += abs(float(np.arctan2(np.sin(step[2]), np.cos(step[2]))))
        self.last = odometry


@dataclass
class _BagFacts:
    """What a bag is checked for, gathered as it is replayed."""

    scans: _ScanFacts = field(default_factory=_ScanFacts)
    odometry: _OdometryFacts = field(default_factory=_OdometryFacts)

    def add_scan(self, scan: Scan) -> None:
        self.scans.add(scan)

    def add_odometry(self, odometry: Odometry) -> None:
        self.odometry.add(odometry)


@dataclass(frozen=True)
class BagCheck:
    """Facts about a bag and findings."""

    path: Path
    size_mb: float
    topics: list[BagTopic]
    facts: dict[str, dict[str, Any]]
    """By section (``scans``, ``sensor``, ``odometry``), figures with units in their names."""
    counts: dict[str, int]
    findings: list[Finding]

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return {
            "bag": str(self.path),
            "size_mb": self.size_mb,
            "topics": [
                {"name": topic.name, "type": topic.message_type, "messages": topic.message_count}
                for topic in self.topics
            ],
            **self.facts,
            "counts": self.counts,
            "findings": [{"what": finding.what, "remedy": finding.remedy} for finding in self.findings],
        }


def check_bag(reader: BagReader, progress: Callable[[float], None] | None = None) -> BagCheck:
    """Read the whole bag once. ``progress`` is called with the messages read.

    Raises UserError when no scan of it is usable.
    """
    gathered = _BagFacts()
    for message in reader:
        feed(message, gathered)
        if progress is not None and reader.messages_read % 256 == 0:
            progress(reader.messages_read)
    scans, odometry = gathered.scans, gathered.odometry
    facts = {
        "scans": _describe_scans(reader, scans),
        "sensor": {"place": list(_rounded(reader.base_from_laser)), "source": reader.base_from_laser_source},
        "odometry": _describe_odometry(reader, odometry),
    }
    findings = [*reader.findings, *_scan_findings(scans), *_odometry_findings(reader, odometry)]
    return BagCheck(
        reader.path, _size_mb(reader.path), list(reader.topics.values()), facts, reader.counts, findings
    )


def _describe_scans(reader: BagReader, scans: _ScanFacts) -> dict[str, Any]:
    degrees = np.degrees([scans.first_bearing, scans.last_bearing])
    return {
        "topic": reader.scan_topic,
        "count": scans.spacing.count,
        "duration_s": round(scans.spacing.seconds, 3),
        "rate_hz": round(scans.spacing.rate, 2),
        "beams_fewest": scans.fewest_beams,
        "beams_most": scans.most_beams,
        "first_bearing_deg": round(float(degrees[0]), 2),
        "last_bearing_deg": round(float(degrees[1]), 2),
        "field_of_view_deg": round(float(degrees[1] - degrees[0]), 2),
        "sweep_s": round(scans.longest_sweep, 4),
        "max_range_m": round(scans.max_range, 2),
        "nearest_return_m": round(scans.nearest, 3) if scans.farthest else None,
        "farthest_return_m": round(scans.farthest, 3) if scans.farthest else None,
        "missed_share": round(scans.misses / scans.beams, 4),
        "no_information_share": round(scans.invalid / scans.beams, 4),
    }


def _describe_odometry(reader: BagReader, odometry: _OdometryFacts) -> dict[str, Any]:
    if reader.odom_topic is None:
        return {}
    counts = reader.counts
    covered = counts["scans"] - counts.get("scans_without_odometry", 0)
    return {
        "topic": reader.odom_topic,
        "count": odometry.spacing.count,
        "duration_s": round(odometry.spacing.seconds, 3),
        "rate_hz": round(odometry.spacing.rate, 2),
        "path_length_m": round(odometry.path_length, 2),
        "turned_deg": round(float(np.degrees(odometry.turned)), 1),
        "top_speed_m_s": round(odometry.top_speed, 2),
        "scans_covered_share": round(covered / counts["scans"], 4),
    }


def _scan_findings(scans: _ScanFacts) -> list[Finding]:
    findings = []
    if scans.invalid > _INVALID_SHARE * scans.beams:
        findings.append(
            Finding(
                f"{scans.invalid / scans.beams:.0%} of the beams hold no reading "
                "(NaN, zero or below range_min).",
                "Clean the sensor's window, see that the car does not cover it, and look at range_min.",
            )
        )
    if scans.farthest == 0.0:
        findings.append(
            Finding("Not one beam met anything.", "See that the sensor works, and that range_max is right.")
        )
    if scans.spacing.missing_share > _MISSING_SHARE:
        findings.append(
            Finding(
                f"Scans come unevenly: after {scans.spacing.missing_share:.1%} of them a sweep is missing.",
                "Record to a faster disk, or fewer topics, unless the sensor is meant to work like that.",
            )
        )
    return findings


def _odometry_findings(reader: BagReader, odometry: _OdometryFacts) -> list[Finding]:
    if reader.odom_topic is None:
        return []
    findings = []
    if odometry.path_length < _LEAST_PATH:
        findings.append(
            Finding(
                f"By its odometry the car moves {odometry.path_length:.2f} m in all.",
                "If it did drive, name another topic with --odom-topic, or ignore it with --no-odom.",
            )
        )
    if odometry.jumps:
        findings.append(
            Finding(
                f"The odometry jumps {odometry.jumps} times, faster than any car.",
                "See that only one node publishes it and that it is not reset while driving.",
            )
        )
    if odometry.top_speed > 1.0 and odometry.spacing.rate < _LOWEST_ODOMETRY_RATE:
        findings.append(
            Finding(
                f"The odometry comes {odometry.spacing.rate:.1f} times a second, at up to "
                f"{odometry.top_speed:.1f} m/s.",
                "Publish it at 20 Hz or more, so that the motion within a sweep is known.",
            )
        )
    return findings


def _rounded(pose: Pose) -> list[float]:
    return [round(float(value), 4) for value in pose]


def _size_mb(path: Path) -> float:
    files = [path] if path.is_file() else [file for file in path.iterdir() if file.is_file()]
    return round(sum(file.stat().st_size for file in files) / 1e6, 3)
