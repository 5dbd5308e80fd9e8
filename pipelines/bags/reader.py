"""A bag as a stream of scans and odometry, with all that real logs have wrong with them mended or counted."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.clock import StampClock, clock_offset, typical_gap
from racecar.pipelines.bags.converters.laser_scans import LaserScanConverter
from racecar.pipelines.bags.converters.odometry import OdometryConverter, only_twist_is_set
from racecar.pipelines.bags.converters.point_clouds import PointCloudConverter
from racecar.pipelines.bags.converters.transforms import SensorPlace, TransformTree
from racecar.pipelines.bags.findings import Finding, counted_findings
from racecar.pipelines.bags.messages import (
    LASER_SCAN,
    ODOMETRY,
    POINT_CLOUD,
    TRANSFORMS,
    decode,
    frame_name,
    nanoseconds,
)
from racecar.pipelines.bags.order import Item, after_their_odometry, in_order
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import choose_topic, list_topics

BASE_FRAMES = ("base_link", "base_footprint")
GAP_SECONDS = 10.0
"""Between two scans; more is worth telling."""

_SAMPLES = 25  # messages looked at beforehand
_LONGEST_SWEEP = 1.0  # seconds
_LISTED_GAPS = 5


@dataclass(frozen=True)
class _Samples:
    """The first messages of a topic, with their recording times."""

    topic: BagTopic
    recorded: list[int]
    messages: list[Any]

    @property
    def headers(self) -> list[int]:
        return [nanoseconds(message.header.stamp) for message in self.messages]

    @property
    def clock_offset(self) -> int | None:
        return clock_offset(list(zip(self.headers, self.recorded, strict=True)))


class BagReader:
    """Scans and odometry of a bag in the order of time; memory does not grow with the bag.

    A scan comes after the odometry that covers its last beam, or half a second of log later. Iterating
    again starts afresh, and ends in a UserError when not one scan was usable. Close it, or use it as a
    context manager.
    """

    def __init__(
        self,
        path: Path,
        *,
        scan_topic: str | None = None,
        odom_topic: str | None = None,
        use_odometry: bool = True,
        base_from_laser: Pose | None = None,
        min_height: float = 0.1,
        max_height: float = 1.0,
    ) -> None:
        """Open a bag and find out what it holds.

        ``base_from_laser`` (3,) overrides the transforms in the bag. Of a PointCloud2 the points between
        ``min_height`` and ``max_height`` (metres above the base frame) make the scan; the cloud of a planar
        sensor is taken whole. Raises UserError when the path holds no bag, a named topic is not in it, or
        not one scan can be read.
        """
        self._store = BagStore(path)
        self._findings: list[Finding] = []
        self._odometry: _Samples | None = None
        self._integrate_twist = False
        try:
            self._open_scans(scan_topic)
            if use_odometry:
                self._open_odometry(odom_topic)
            self._place = self._find_place(base_from_laser)
        except BaseException:
            self._store.close()
            raise
        self._heights = (min_height, max_height)
        self._gaps: list[str] = []
        self._counter: Counter[str] = Counter()
        self.messages_read = 0
        """Of the chosen topics; advances while iterating."""

    def __enter__(self) -> "BagReader":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the files."""
        self._store.close()

    @property
    def path(self) -> Path:
        """The bag."""
        return self._store.path

    @property
    def topics(self) -> dict[str, BagTopic]:
        """All topics by name."""
        return self._store.topics

    @property
    def scan_topic(self) -> str:
        """Topic of the scans."""
        return self._scans.topic.name

    @property
    def odom_topic(self) -> str | None:
        """Topic of the odometry."""
        return self._odometry.topic.name if self._odometry else None

    @property
    def base_from_laser(self) -> Pose:
        """(3,) the sensor's place on the car."""
        return self._place.pose

    @property
    def base_from_laser_source(self) -> str:
        """``flag``, ``tf_static``, ``base frame`` or ``assumed identity``."""
        return self._place.source

    @property
    def inputs(self) -> dict[str, object]:
        """What is read, and what of the car is taken for granted, for reports."""
        return {
            "scan_topic": self.scan_topic,
            "odom_topic": self.odom_topic,
            "base_from_laser": self.base_from_laser,
            "base_from_laser_source": self.base_from_laser_source,
        }

    @property
    def message_count(self) -> int:
        """Messages of the chosen topics, as many as there should be."""
        return sum(samples.topic.message_count for samples in (self._scans, self._odometry) if samples)

    @property
    def counts(self) -> dict[str, int]:
        """What was read, mended and dropped so far; but for the first two only what occurred."""
        counts = {"scans": 0, "odometry": 0, **self._counter}
        counts["unreadable_messages"] = self._store.unreadable_messages
        return {name: count for name, count in counts.items() if count or name in ("scans", "odometry")}

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the bag; complete after iterating."""
        losses = [
            Finding(loss, "Copy the bag again from where it was recorded.") for loss in self._store.losses
        ]
        return [*losses, *self._findings, *self._gap_findings(), *counted_findings(self._counter)]

    @property
    def warnings(self) -> list[str]:
        """The findings as sentences for people."""
        return [finding.what for finding in self.findings]

    def __iter__(self) -> Iterator[Scan | Odometry]:
        self._counter.clear()
        self._gaps.clear()
        self.messages_read = 0
        items = in_order(self._items(), self._counter)
        if self._odometry is not None:
            items = after_their_odometry(items, self._counter)
        last_scan: Scan | None = None
        for item in items:
            if isinstance(item, Scan):
                self._counter["scans"] += 1
                self._note_gap(last_scan, item)
                last_scan = item
            else:
                self._counter["odometry"] += 1
            yield item
        if last_scan is None:
            raise UserError(
                f"{self.path} holds no usable scan on {self.scan_topic}: {' '.join(self.warnings)}"
            )

    def _open_scans(self, scan_topic: str | None) -> None:
        topics = self._store.topics
        scans = choose_topic(
            topics, (LASER_SCAN, POINT_CLOUD), scan_topic, "Scans", "--scan-topic", self._findings
        )
        if scans is None:
            losses = "".join(f" {sentence}" for sentence in self._store.losses)
            raise UserError(
                f"{self.path} holds no laser scans (LaserScan or PointCloud2); "
                f"its topics are {list_topics(topics)}.{losses}"
            )
        self._scans = self._sample(scans)
        if not self._scans.messages:
            raise UserError(f"Not one scan of {scans.name} in {self.path} can be read.")

    def _open_odometry(self, odom_topic: str | None) -> None:
        topic = choose_topic(
            self._store.topics, (ODOMETRY,), odom_topic, "Odometry messages", "--odom-topic", self._findings
        )
        samples = self._sample(topic) if topic else None
        if samples is None or not samples.messages:
            self._findings.append(
                Finding(
                    "There is no odometry: the motion must be told from the scans alone.",
                    "Record the odometry topic too, or drive slowly and where there is much to see.",
                )
            )
            return
        self._odometry = samples
        self._integrate_twist = only_twist_is_set(
            message for _, message in self._decoded(samples.topic, Counter())
        )
        if self._integrate_twist:
            self._findings.append(
                Finding(
                    f"The poses of {samples.topic.name} stand still while its speeds do not: "
                    "the pose is integrated from the speeds.",
                    "Nothing: this is handled.",
                )
            )

    def _sample(self, topic: BagTopic) -> _Samples:
        first = list(islice(self._decoded(topic, Counter()), _SAMPLES))
        return _Samples(topic, [recorded for recorded, _ in first], [message for _, message in first])

    def _decoded(self, topic: BagTopic, counts: Counter[str]) -> Iterator[tuple[int, Any]]:
        for _, recorded, data in self._store.messages([topic.name]):
            message = _decode_or_count(topic, data, counts)
            if message is not None:
                yield recorded, message

    def _find_place(self, base_from_laser: Pose | None) -> SensorPlace:
        """The sensor's place: told by the user, found in the bag, or assumed."""
        if base_from_laser is not None:
            return SensorPlace.from_pose(base_from_laser, "flag")
        tree, frame = self._transforms(), self._scan_frame
        for base in (*BASE_FRAMES, *self._odometry_frames):
            matrix = tree.between(base, frame)
            if matrix is not None and base != frame:
                place = SensorPlace(matrix, "tf_static")
                if place.tilt > np.radians(10):
                    tilt = np.degrees(place.tilt)
                    self._findings.append(
                        Finding(
                            f"The sensor is tilted by {tilt:.0f}°: it is taken as level.",
                            "Mount it level; else walls appear too far and the floor as a wall.",
                        )
                    )
                return place
        if self._is_base(frame):
            return SensorPlace.from_pose(IDENTITY, "base frame")
        self._findings.append(
            Finding(
                f"The bag does not tell where {frame or 'the sensor'} sits on the car (no transform from "
                "base_link in /tf_static): it is taken to be at base_link.",
                "Tell it with --laser-pose X Y YAW, or record /tf_static.",
            )
        )
        return SensorPlace.from_pose(IDENTITY, "assumed identity")

    def _transforms(self) -> TransformTree:
        tree = TransformTree()
        topic = self._store.topics.get("/tf_static")
        if topic is not None and topic.message_type == TRANSFORMS:
            for _, message in self._decoded(topic, Counter()):
                for transform in message.transforms:
                    tree.add(transform)
        return tree

    @property
    def _scan_frame(self) -> str:
        return frame_name(self._scans.messages[0].header.frame_id)

    @property
    def _odometry_frames(self) -> list[str]:
        return [frame_name(self._odometry.messages[0].child_frame_id)] if self._odometry else []

    def _is_base(self, frame: str) -> bool:
        return frame in (*BASE_FRAMES, *self._odometry_frames) and frame != ""

    def _items(self) -> Iterator[Item]:
        """What the messages hold, in the order of recording."""
        scan_converter = self._scan_converter()
        odometry_converter = OdometryConverter(self._integrate_twist, self._counter)
        clocks = self._clocks()
        for name, recorded, data in self._store.messages(list(clocks)):
            self.messages_read += 1
            message = _decode_or_count(self._store.topics[name], data, self._counter)
            if message is None:
                continue
            stamp = clocks[name].stamp(nanoseconds(message.header.stamp), recorded)
            converter = scan_converter if name == self.scan_topic else odometry_converter
            item = converter.convert(message, stamp)
            if item is not None:
                yield item

    def _scan_converter(self) -> LaserScanConverter | PointCloudConverter:
        if self._scans.topic.message_type == LASER_SCAN:
            gap = typical_gap(self._scans.headers if self._scans.clock_offset else self._scans.recorded)
            return LaserScanConverter(self._place, min(_LONGEST_SWEEP, 1.5 * gap), self._counter)
        points_are_in_base = self._is_base(self._scan_frame)
        points_place = np.eye(4) if points_are_in_base else self._place.base_from_sensor
        return PointCloudConverter(points_place, self._place, self._heights, self._counter)

    def _clocks(self) -> dict[str, StampClock]:
        """A clock per chosen topic; a topic without stamps of its own keeps to the other's clock."""
        chosen = [samples for samples in (self._scans, self._odometry) if samples]
        known = [samples.clock_offset for samples in chosen if samples.clock_offset is not None]
        common = known[0] if known else 0
        clocks = {}
        for samples in chosen:
            own = samples.clock_offset
            offset = common if own is None else own
            clocks[samples.topic.name] = StampClock(offset, own is not None, self._counter)
        return clocks

    def _note_gap(self, last: Scan | None, scan: Scan) -> None:
        seconds = 0.0 if last is None else (scan.stamp - last.stamp) * 1e-9
        if seconds > GAP_SECONDS:
            self._counter["gaps"] += 1
            if len(self._gaps) < _LISTED_GAPS:
                self._gaps.append(f"a gap of {seconds:.0f} s after scan {self._counter['scans'] - 1}")

    def _gap_findings(self) -> list[Finding]:
        if not self._gaps:
            return []
        more = self._counter["gaps"] - len(self._gaps)
        what = f"There is {', '.join(self._gaps)}{f' and {more} more' if more else ''}."
        return [
            Finding(what, "Nothing, if the car stood still meanwhile; otherwise the map may break there.")
        ]


def _decode_or_count(topic: BagTopic, data: bytes, counts: Counter[str]) -> Any | None:
    try:
        return decode(topic, data)
    except Exception:  # whatever deserializing damaged bytes raises
        counts["undecodable_messages"] += 1
        return None
