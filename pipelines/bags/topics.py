"""Which of a bag's topics are the scans and the odometry."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np

from racecar.maps.errors import UserError
from racecar.pipelines.bags.converters.transforms import namespace_of
from racecar.pipelines.bags.messages import LASER_SCAN
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.sensors.findings import Finding

NOT_WHEELS = ("ground_truth", "groundtruth", "/pf/", "amcl")
"""In names of odometry topics with a solution or the truth instead of dead reckoning."""
_NOT_BY_WHEELS = (
    *("camera", "visual", "vio", "t265", "rtabmap", "icp", "rf2o", "laser", "lidar", "lio", "loam"),
    *("slam", "gps", "global", "map", "mocap", "vicon", "truth"),
)
"""In names of odometry from cameras, scans or satellites; wheels are an independent source."""
_PROCESSED = (
    *("filter", "stable", "extrapol", "project", "process", "smooth", "clean", "crop", "throttle"),
    *("downsample", "reduced", "correct", "deskew", "merge", "multi", "combin", "fuse", "virtual", "fake"),
    *("cloud", "depth", "camera", "kinect", "realsense", "obstacle", "clear", "debug", "tilt"),
)
"""In names of scans that were computed from others or from images, or are from a nodding laser."""
_OF_CAMERAS = (
    "camera",
    "realsense",
    "d4",
    "t265",
    "zed",
    "oak",
    "depth",
    "lidar",
    "ouster",
    "livox",
    "velodyne",
)
"""In names of IMUs inside other sensors, whose axes are rarely those of the car."""
_RAW = "raw"
_FIELDS_OF_VIEW = (170.0, 95.0)
"""Degrees from which a scanner sees all around or to both sides; depth cameras see 57° to 90°."""
_LEAST_SHARE = 0.1
"""Share of the messages on the fullest topic; a laser publishes continuously and has more."""


def choose_odometry(
    topics: Mapping[str, BagTopic],
    types: Sequence[str],
    named: str | None,
    near: str,
    findings: list[Finding],
) -> BagTopic | None:
    """The named topic, or else the one with most messages for the robot that the topic ``near`` belongs to,
    from wheels if possible; None if there is none.

    An ambiguous choice is added to ``findings``. Raises UserError when the named topic is not in the bag or
    has another type.
    """
    if named is not None:
        return named_topic(topics, types, named, "Odometry messages")
    found = _of_types(topics, types)
    wheels = [topic for topic in found if not _is_named(topic, NOT_WHEELS)] or found
    found = _best_of_robot(wheels, near, _NOT_BY_WHEELS)
    if len(found) > 1:
        others = ", ".join(topic.name for topic in found[1:])
        findings.append(Finding("odometry_topic_of_several", taken=found[0].name, others=others))
    return found[0] if found else None


def choose_imu(
    topics: Mapping[str, BagTopic], types: Sequence[str], named: str | None, near: str
) -> BagTopic | None:
    """The named topic, or else the one with most messages for the robot that the topic ``near`` belongs to,
    not from inside another sensor if possible; None if there is none.

    Raises UserError when the named topic is not in the bag or has another type.
    """
    if named is not None:
        return named_topic(topics, types, named, "IMU messages")
    return next(iter(_best_of_robot(_of_types(topics, types), near, _OF_CAMERAS)), None)


def _of_types(topics: Mapping[str, BagTopic], types: Sequence[str]) -> list[BagTopic]:
    """Topics with messages of the types."""
    return [topic for topic in topics.values() if topic.message_type in types and topic.message_count]


def _best_of_robot(found: Sequence[BagTopic], near: str, doubtful: Sequence[str]) -> list[BagTopic]:
    """Topics of the robot that the topic ``near`` belongs to, or else all; those with ``doubtful`` parts in
    their names last, otherwise the fullest first."""
    robot = namespace_of(near)
    own = [topic for topic in found if robot and topic.name.startswith(robot + "/")]
    return sorted(
        own or found, key=lambda topic: (_is_named(topic, doubtful), -topic.message_count, topic.name)
    )


@dataclass(frozen=True)
class ScanView:
    """What the first scans of a topic show about its sensor."""

    topic: BagTopic
    field_of_view: float
    """Degrees."""
    beams: int
    returns: int
    """Total in the first scans."""
    beside: float = 0.0
    """Share of the messages of the fullest topic."""

    @classmethod
    def of(cls, topic: BagTopic, messages: Sequence[Any], fullest: int) -> "ScanView":
        """Summarize the first messages of a topic, LaserScans or others with ranges."""
        share = topic.message_count / max(fullest, 1)
        messages = [message for message in messages if len(message.ranges) > 1]
        if not messages:
            return cls(topic, 0.0, 0, 0, share)
        first = messages[0]
        beams = len(first.ranges)
        increments = abs(float(first.angle_increment)) * (beams - 1)
        span = abs(float(first.angle_max) - float(first.angle_min))
        # A wrong increment is handled elsewhere; the narrower reading is safe, as both are rarely wrong.
        angle = min((each for each in (increments, span) if 0.0 < each < np.inf), default=0.0)
        returns = sum(_returns_of(message) for message in messages)
        return cls(topic, min(float(np.degrees(angle)), 360.0), beams, returns, share)

    @property
    def is_processed(self) -> bool:
        """Whether it was computed from other scans or from images, judging by its name."""
        return _is_named(self.topic, _PROCESSED) and _RAW not in self.topic.name.lower()

    @property
    def preference(self) -> tuple[object, ...]:
        """Sort key; larger is better for a map."""
        name = self.topic.name.rpartition("/")[2].lower()
        return (
            self.returns > 0 and self.beside >= _LEAST_SHARE,
            sum(self.field_of_view >= wide for wide in _FIELDS_OF_VIEW),
            not self.is_processed,
            _RAW in name,
            name == "scan",
            round(self.field_of_view, -1),
            self.beams,
            self.topic.message_count,
        )

    def __str__(self) -> str:
        what = f"{self.topic.name} ({self.field_of_view:.0f}°, {self.beams} beams"
        if self.returns == 0:
            return what + ", nothing seen)"
        return what + (", processed by its name)" if self.is_processed else ")")


def choose_scans(
    topics: Mapping[str, BagTopic],
    types: Sequence[str],
    named: Sequence[str],
    first_messages: Callable[[BagTopic], Sequence[Any]],
    findings: list[Finding],
) -> list[BagTopic]:
    """The named topics, or else one: of the first type present, the one with the widest view, as of a laser.

    Raw scans are preferred to processed ones and to the narrow ones of depth cameras. Only one topic is
    chosen, even if two lasers look front and rear: their mounts may not be measured exactly, and walls that
    both see would then be doubled. The choice is added to ``findings``. Raises UserError when a named topic
    is not in the bag or has another type.
    """
    if named:
        chosen = [named_topic(topics, types, name, "Scans") for name in named]
        return list({topic.name: topic for topic in chosen}.values())
    for message_type in types:
        found = _of_types(topics, [message_type])
        if len(found) > 1 and message_type == LASER_SCAN:
            found = _by_view(found, first_messages, findings)
        elif len(found) > 1:
            found.sort(key=lambda topic: (-topic.message_count, topic.name))
            others = ", ".join(topic.name for topic in found[1:])
            findings.append(Finding("scan_topic_of_several", taken=found[0].name, others=others))
        if found:
            return found[:1]
    return []


def _by_view(
    found: Sequence[BagTopic],
    first_messages: Callable[[BagTopic], Sequence[Any]],
    findings: list[Finding],
) -> list[BagTopic]:
    """Topics of lasers, best first."""
    fullest = max(topic.message_count for topic in found)
    ordered = sorted(found, key=lambda topic: topic.name)
    views = [ScanView.of(topic, first_messages(topic), fullest) for topic in ordered]
    views.sort(key=lambda view: view.preference, reverse=True)
    best, *others = views
    findings.append(Finding("laser_of_several", taken=str(best), others=", ".join(map(str, others))))
    return [view.topic for view in views]


def _returns_of(message: Any) -> int:
    ranges = np.asarray(message.ranges, dtype=np.float64)
    farthest = message.range_max if message.range_max > 0 else np.inf
    return int(np.count_nonzero((ranges > max(message.range_min, 0.0)) & (ranges < farthest)))


def named_topic(topics: Mapping[str, BagTopic], types: Sequence[str], named: str, purpose: str) -> BagTopic:
    """The topic with this name. Raises UserError when it is not in the bag or has another type."""
    topic = topics.get(named) or topics.get("/" + named)
    if topic is None:
        close = get_close_matches(named, topics, n=1, cutoff=0.5)
        hint = f" (did you mean {close[0]}?)" if close else ""
        raise UserError(f"There is no topic {named} in the bag{hint}; its topics are {list_topics(topics)}.")
    if topic.message_type not in types:
        usable = ", ".join(topic.name for topic in topics.values() if topic.message_type in types) or "none"
        raise UserError(
            f"Topic {topic.name} holds {topic.message_type}, not {purpose.lower()}; topics that do: {usable}."
        )
    return topic


def _is_named(topic: BagTopic, parts: Sequence[str]) -> bool:
    return any(part in topic.name.lower() for part in parts)


def list_topics(topics: Mapping[str, BagTopic]) -> str:
    """All topics with their types, for users."""
    return ", ".join(f"{topic.name} ({topic.message_type})" for topic in topics.values()) or "none"
