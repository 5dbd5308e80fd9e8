"""What a bag contains, and its faults, before mapping."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.facts import OdometryFacts, ScanFacts, YawRateFacts
from racecar.pipelines.bags.part import BagPart
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.sensors.findings import Finding


@dataclass(frozen=True)
class BagCheck:
    """Figures and findings about a bag."""

    path: Path
    part: BagPart
    size_mb: float
    topics: list[BagTopic]
    facts: dict[str, dict[str, Any]]
    """Figures by section (``scans``, ``sensor``, ``odometry``, ``imu``), with units in their names."""
    counts: dict[str, int]
    findings: list[Finding]

    def as_dict(self) -> dict[str, Any]:
        """Contents for a JSON file."""
        return {
            "bag": str(self.path),
            **({} if self.part.is_whole else {"part": asdict(self.part)}),
            "size_mb": self.size_mb,
            "topics": [
                {"name": topic.name, "type": topic.message_type, "messages": topic.message_count}
                for topic in self.topics
            ],
            **self.facts,
            "counts": self.counts,
            "findings": [finding.as_dict() for finding in self.findings],
        }


def check_bag(reader: BagReader, progress: Callable[[float], None] | None = None) -> BagCheck:
    """Read the whole bag once. ``progress`` is called with the number of messages read.

    Raises UserError when it has no usable scan.
    """
    for _ in reader:
        if progress is not None and reader.messages_read % 256 == 0:
            progress(reader.messages_read)
    facts = {
        "scans": _describe_scans(reader, reader.heard.scans),
        "sensor": {
            "place": list(_rounded(reader.base_from_laser)),
            "upside_down": reader.laser_is_upside_down,
            "source": reader.base_from_laser_source,
        },
        "odometry": _describe_odometry(reader, reader.heard.odometry),
        "imu": _describe_imu(reader, reader.heard.yaw_rates),
    }
    return BagCheck(
        reader.path,
        reader.part,
        _size_mb(reader.path),
        list(reader.topics.values()),
        facts,
        reader.counts,
        reader.findings,
    )


def _describe_scans(reader: BagReader, scans: ScanFacts) -> dict[str, Any]:
    degrees = np.degrees([scans.first_bearing, scans.last_bearing])
    return {
        "topic": reader.scan_topic,
        "count": scans.count,
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


def _describe_odometry(reader: BagReader, odometry: OdometryFacts) -> dict[str, Any]:
    if reader.left_out_odom_topic is not None:
        return {"topic": reader.left_out_odom_topic, "is_used": False}
    if reader.odom_topic is None:
        return {}
    counts = reader.counts
    covered = counts["scans"] - counts.get("scans_without_odometry", 0)
    return {
        "topic": reader.odom_topic,
        "source": reader.odometry_source,
        "count": odometry.spacing.count,
        "duration_s": round(odometry.spacing.seconds, 3),
        "rate_hz": round(odometry.spacing.rate, 2),
        "path_length_m": round(odometry.path_length, 2),
        "turned_deg": round(float(np.degrees(odometry.turned)), 1),
        "top_speed_m_s": round(odometry.top_speed, 2),
        "scans_covered_share": round(covered / counts["scans"], 4),
    }


def _describe_imu(reader: BagReader, yaw_rates: YawRateFacts) -> dict[str, Any]:
    if reader.imu_topic is None:
        return {}
    return {
        "topic": reader.imu_topic,
        "count": yaw_rates.spacing.count,
        "rate_hz": round(yaw_rates.spacing.rate, 2),
        "fastest_turn_deg_s": round(float(np.degrees(yaw_rates.fastest_turn)), 1),
    }


def _rounded(pose: Pose) -> list[float]:
    return [round(float(value), 4) for value in pose]


def _size_mb(path: Path) -> float:
    files = [path] if path.is_file() else [file for file in path.iterdir() if file.is_file()]
    return round(sum(file.stat().st_size for file in files) / 1e6, 3)
