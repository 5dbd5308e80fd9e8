"""A bag as a stream of scans and odometry; whatever is wrong with real logs is mended or counted."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.clock import StampClock, clock_offset, typical_gap
from racecar.pipelines.bags.converters.odometry import only_twist_is_set
from racecar.pipelines.bags.converters.point_clouds import SECTION_HEIGHTS
from racecar.pipelines.bags.converters.registry import (
    ODOMETRY_CONVERTERS,
    SCAN_CONVERTERS,
    Converter,
    ScanSetup,
)
from racecar.pipelines.bags.facts import OdometryFacts, ScanFacts
from racecar.pipelines.bags.findings import Finding, counted_findings
from racecar.pipelines.bags.messages import TRANSFORMS, decode, frame_name, nanoseconds
from racecar.pipelines.bags.order import Item, after_their_odometry, in_order
from racecar.pipelines.bags.scan_gaps import ScanGaps
from racecar.pipelines.bags.sensor_place import BASE_FRAMES, find_place
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import choose_topic, list_topics

_SAMPLES = 25
"""Messages looked at beforehand: enough for medians of their spacing, and read in no time."""
_LONGEST_SWEEP = 1.0
"""Seconds; the slowest scanners, of the RPLIDAR kind, turn twice a second."""


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
        min_height: float = SECTION_HEIGHTS[0],
        max_height: float = SECTION_HEIGHTS[1],
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
            self._place = find_place(
                self._scan_frame,
                self._base_frames,
                self._static_transforms(),
                base_from_laser,
                self._findings,
            )
        except BaseException:
            self._store.close()
            raise
        self._heights = (min_height, max_height)
        self._gaps = ScanGaps()
        self.scan_facts = ScanFacts()
        """What the scans read so far are like."""
        self.odometry_facts = OdometryFacts()
        """What the odometry read so far is like."""
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
        """Close the files."""
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
        """What is read, and what is assumed of the car, for reports."""
        return {
            "scan_topic": self.scan_topic,
            "odom_topic": self.odom_topic,
            "base_from_laser": self.base_from_laser,
            "base_from_laser_source": self.base_from_laser_source,
        }

    @property
    def message_count(self) -> int:
        """Messages of the chosen topics that the bag announces."""
        return sum(samples.topic.message_count for samples in (self._scans, self._odometry) if samples)

    @property
    def counts(self) -> dict[str, int]:
        """What was read, mended and dropped so far: scans and odometry always, all else if it occurred."""
        counts = {"scans": 0, "odometry": 0, **self._counter}
        counts |= {"gaps": self._gaps.count, "unreadable_messages": self._store.unreadable_messages}
        return {name: count for name, count in counts.items() if count or name in ("scans", "odometry")}

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the bag; complete after iterating."""
        losses = [
            Finding(loss, "Copy the bag again from where it was recorded.") for loss in self._store.losses
        ]
        notes = [Finding(what, remedy) for what, remedy in self._store.notes]
        return [
            *losses,
            *notes,
            *self._findings,
            *self._gaps.findings,
            *counted_findings(self._counter),
            *self.scan_facts.findings,
            *self.odometry_facts.findings,
        ]

    @property
    def warnings(self) -> list[str]:
        """The findings as sentences for people."""
        return [finding.sentence for finding in self.findings]

    def __iter__(self) -> Iterator[Scan | Odometry]:
        self._counter.clear()
        self._gaps, self.scan_facts, self.odometry_facts = ScanGaps(), ScanFacts(), OdometryFacts()
        self.messages_read = 0
        items = in_order(self._items(), self._counter)
        if self._odometry is not None:
            items = after_their_odometry(items, self._counter)
        for item in items:
            if isinstance(item, Scan):
                self._gaps.add(item)
                self.scan_facts.add(item)
            else:
                self.odometry_facts.add(item)
            self._counter["scans" if isinstance(item, Scan) else "odometry"] += 1
            yield item
        if not self._counter["scans"]:
            raise UserError(
                f"{self.path} holds no usable scan on {self.scan_topic}: {' '.join(self.warnings)}"
            )

    def _open_scans(self, scan_topic: str | None) -> None:
        topics = self._store.topics
        scans = choose_topic(
            topics, tuple(SCAN_CONVERTERS), scan_topic, "Scans", "--scan-topic", self._findings
        )
        if scans is None:
            losses = "".join(f" {sentence}" for sentence in self._store.losses)
            raise UserError(
                f"{self.path} holds no laser scans ({_type_names(SCAN_CONVERTERS)}); "
                f"its topics are {list_topics(topics)}.{losses}"
            )
        self._scans = self._sample(scans)
        if not self._scans.messages:
            raise UserError(f"Not one scan of {scans.name} in {self.path} can be read.")

    def _open_odometry(self, odom_topic: str | None) -> None:
        topic = choose_topic(
            self._store.topics,
            tuple(ODOMETRY_CONVERTERS),
            odom_topic,
            "Odometry messages",
            "--odom-topic",
            self._findings,
        )
        samples = self._sample(topic) if topic else None
        if samples is None or not samples.messages:
            self._findings.append(
                Finding(
                    "There is no odometry: the motion must be estimated from the scans alone.",
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

    def _static_transforms(self) -> Iterator[Any]:
        topic = self._store.topics.get("/tf_static")
        if topic is not None and topic.message_type == TRANSFORMS:
            for _, message in self._decoded(topic, Counter()):
                yield from message.transforms

    @property
    def _scan_frame(self) -> str:
        return frame_name(self._scans.messages[0].header.frame_id)

    @property
    def _base_frames(self) -> list[str]:
        of_odometry = [frame_name(self._odometry.messages[0].child_frame_id)] if self._odometry else []
        return [frame for frame in (*BASE_FRAMES, *of_odometry) if frame]

    def _items(self) -> Iterator[Item]:
        """What the messages hold, in the order of recording."""
        converters, clocks = self._converters(), self._clocks()
        for name, recorded, data in self._store.messages(list(clocks)):
            self.messages_read += 1
            message = _decode_or_count(self._store.topics[name], data, self._counter)
            if message is None:
                continue
            stamp = clocks[name].stamp(nanoseconds(message.header.stamp), recorded)
            item = converters[name].convert(message, stamp)
            if item is not None:
                yield item

    def _converters(self) -> dict[str, Converter[Item]]:
        """By topic."""
        scans, odometry = self._scans, self._odometry
        gap = typical_gap(scans.headers if scans.clock_offset else scans.recorded)
        setup = ScanSetup(
            self._place,
            points_are_in_base=self._scan_frame in self._base_frames,
            longest_sweep=min(_LONGEST_SWEEP, 1.5 * gap),
            heights=self._heights,
        )
        converters: dict[str, Converter[Item]] = {
            scans.topic.name: SCAN_CONVERTERS[scans.topic.message_type](setup, self._counter)
        }
        if odometry is not None:
            new_converter = ODOMETRY_CONVERTERS[odometry.topic.message_type]
            converters[odometry.topic.name] = new_converter(self._integrate_twist, self._counter)
        return converters

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


def _decode_or_count(topic: BagTopic, data: bytes, counts: Counter[str]) -> Any | None:
    try:
        return decode(topic, data)
    except Exception:  # whatever deserializing damaged bytes raises
        counts["undecodable_messages"] += 1
        return None


def _type_names(message_types: Iterable[str]) -> str:
    """Such as "LaserScan or PointCloud2"."""
    *others, last = (name.rpartition("/")[2] for name in message_types)
    return f"{', '.join(others)} or {last}" if others else last
