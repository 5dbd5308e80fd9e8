"""A bag as a stream of measurements; the faults of real logs are corrected or counted."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.car_frames import CarFrames, given_place
from racecar.pipelines.bags.converters.framed_scans import FramedScanConverter
from racecar.pipelines.bags.converters.registry import (
    SCAN_CONVERTERS,
    SINGLE_ECHOES,
    YAW_RATE_CONVERTERS,
    Converter,
    stamp_of,
)
from racecar.pipelines.bags.converters.scan_reading import (
    AS_STATED,
    Angles,
    ScanReading,
    ScanSetup,
    learn_reading,
    read_from_the_other_end,
)
from racecar.pipelines.bags.heard import Heard
from racecar.pipelines.bags.motion_sources import MotionSources
from racecar.pipelines.bags.order import after_their_motion, in_order
from racecar.pipelines.bags.part import BagPart
from racecar.pipelines.bags.samples import Samples, decode_or_count, decoded, first_samples
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import choose_scans, list_topics
from racecar.sensors.clocks.recorded_stamps import RecordedStamps
from racecar.sensors.clocks.topic_clock import SteadyClock
from racecar.sensors.config import SensorConfig
from racecar.sensors.corrections import NO_CORRECTIONS, Corrections, Corrector
from racecar.sensors.findings import Finding
from racecar.sensors.measurement import Measurement
from racecar.sensors.scan import Scan

_LONGEST_SWEEP = 1.0
"""Seconds; the slowest scanners, such as RPLIDARs, turn twice a second."""


class BagReader:
    """Scans, odometry and yaw rates of a bag in time order; memory does not grow with the bag.

    A scan follows the motion that covers its last beam, or half a second of log later. Iterating again
    restarts, and raises UserError at the end if no scan was usable. Close it, or use it as a context manager.
    """

    @checked
    def __init__(
        self,
        path: str | Path,
        *,
        scan_topic: str | Sequence[str] | None = None,
        odom_topic: str | None = None,
        imu_topic: str | None = None,
        use_odometry: bool = True,
        use_imu: bool = True,
        laser_pose: ArrayLike | None = None,
        start: float = 0.0,
        duration: float | None = None,
        sensors: SensorConfig | None = None,
    ) -> None:
        """Open a bag and find out what it contains.

        With several ``scan_topic`` all scans are read, each placed by its own frame. ``laser_pose`` (3,), or
        (4,) with a roll, in metres and radians, overrides the transforms in the bag. Only messages recorded
        from ``start`` seconds after the bag's first message are read, for ``duration`` seconds. ``sensors``
        configures which readings count. Raises UserError when the path is not a bag, a named topic is not in
        it, or no scan can be read.
        """
        self.sensors = sensors or SensorConfig()
        """Which readings count, from the next iteration on."""
        self.part = BagPart(start, duration)
        """The part of the bag that is read."""
        self.path = Path(path)
        self._store = BagStore(self.path)
        self._findings: list[Finding] = []
        self._readings: dict[str, ScanReading] = {}
        self._corrections = NO_CORRECTIONS
        self._is_closed = False
        try:
            self.fingerprint = bag_fingerprint(self.path)
            """Digest of the bag's content."""
            named = [scan_topic] if isinstance(scan_topic, str) else list(scan_topic or ())
            self._open_scans(named)
            self._motion = MotionSources(self._store, self._scans[0], self._findings)
            links = self._motion.open(
                odom_topic=odom_topic,
                use_odometry=use_odometry,
                imu_topic=imu_topic,
                use_imu=use_imu,
                is_place_given=laser_pose is not None,
            )
            place = None if laser_pose is None else given_place(laser_pose)
            self._frames = CarFrames(place, links=links)
            self._frames.name_odometry_child(self._motion.odometry_child)
            for frame in dict.fromkeys(frame for samples in self._scans for frame in samples.frames):
                self._frames.placed(frame)
            self.part.require(self._store, self.scan_topics)
        except BaseException:
            self._store.close()
            raise
        self.heard = Heard()
        """Statistics of the chosen topics; grows while iterating."""

    def __enter__(self) -> "BagReader":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the files."""
        self._is_closed = True
        self._store.close()

    def correct(self, corrections: Corrections) -> None:
        """Set the corrections of the sensors, from the next iteration on."""
        self._corrections = corrections
        if not corrections.uses_odometry:
            self._motion.leave_out_odometry()

    def reads_from_the_other_end(self) -> bool:
        """Take the other reading of the first sensor's angles, from the next iteration on; False unless only
        their signs contradict each other and it was not taken yet."""
        reading = self._readings.get(self.scan_topic, AS_STATED)
        if reading.angles != Angles.FROM_LAST:
            return False
        number = next(k for k, each in enumerate(self._findings) if each.name == "angles_not_as_stated")
        self._readings[self.scan_topic], self._findings[number] = read_from_the_other_end(
            reading, self._findings[number]
        )
        return True

    def reads_speeds(self) -> bool:
        """Integrate the odometry's speeds instead of its poses, which are reset again and again, from the
        next iteration on; False if it has none, or that is done already."""
        return self._motion.reads_speeds()

    @property
    def topics(self) -> dict[str, BagTopic]:
        """All topics by name."""
        return self._store.topics

    @property
    def scan_topic(self) -> str:
        """Topic of the scans; the first of several."""
        return self._scans[0].topic.name

    @property
    def scan_topics(self) -> list[str]:
        """All topics of scans."""
        return [samples.topic.name for samples in self._scans]

    @property
    def odom_topic(self) -> str | None:
        """Topic of the odometry."""
        return self._motion.odometry.topic.name if self._motion.odometry else None

    @property
    def imu_topic(self) -> str | None:
        """Topic of the IMU."""
        return self._motion.imu.topic.name if self._motion.imu else None

    @property
    def tells_of_no_odometry(self) -> bool:
        """Whether a finding reports that no odometry is used, and the consequences."""
        return self._motion.tells_of_no_odometry

    @property
    def left_out_odom_topic(self) -> str | None:
        """Topic of odometry that exists but is not used, for the reason that a finding gives."""
        return self._motion.left_out_topic

    @property
    def odometry_source(self) -> str:
        """The odometry's topic, and its links if it is from transforms."""
        if self._motion.odometry_links is not None:
            return f"{self.odom_topic}: {self._motion.odometry_links}, for there is no usable Odometry topic"
        return self.odom_topic or "none"

    @property
    def base_from_laser(self) -> Pose:
        """(3,) place of the first sensor on the car."""
        corrected = self._corrections.base_from_laser
        return self._frames.placed(self._scan_frame).pose if corrected is None else corrected

    @property
    def rival_place(self) -> Pose | None:
        """(3,) another place of the first sensor that the bag states; None if there is none."""
        return self._frames.placed(self._scan_frame).rival

    @property
    def laser_is_upside_down(self) -> bool:
        """Whether the first sensor's bearings run clockwise, seen from above."""
        return self._corrections.is_upside_down != self._frames.placed(self._scan_frame).is_upside_down

    @property
    def base_from_laser_source(self) -> str:
        """``given``, ``tf_static``, ``tf``, ``base frame``, ``assumed identity`` or ``motion``."""
        is_corrected = self._corrections.base_from_laser is not None
        return "motion" if is_corrected else self._frames.placed(self._scan_frame).source

    @property
    def header_offsets(self) -> tuple[int | None, int | None]:
        """Nanoseconds by which the stamps of scans and odometry are ahead of their recording times; None if
        unknown."""
        odometry = self._motion.odometry
        return self._scans[0].clock_offset, odometry.clock_offset if odometry else None

    @property
    def inputs(self) -> dict[str, object]:
        """What is read and assumed about the car, for reports."""
        inputs: dict[str, object] = {
            "bag_fingerprint": self.fingerprint,
            **({} if self.part.is_whole else {"part": asdict(self.part)}),
            "scan_topic": self.scan_topic,
            "odom_topic": self.odom_topic,
            "odometry": self.odometry_source,
            "base_frame": self._frames.placed(self._scan_frame).base_frame,
            "base_from_laser": self.base_from_laser,
            "base_from_laser_source": self.base_from_laser_source,
            "sensors": self.sensors.model_dump(),
            **self._corrections.inputs,
        }
        if self._motion.imu is not None:
            inputs["imu_topic"] = self.imu_topic
        if len(self._scans) > 1:
            inputs["scan_topics"] = self.scan_topics
        if len(self._frames.places) > 1:
            inputs["lasers"] = {
                frame: {"base_from_laser": place.pose, "source": place.source}
                for frame, place in self._frames.places.items()
            }
        return inputs

    @cached_property
    def message_count(self) -> int:
        """Messages of the chosen topics announced by the bag, or counted in the part of it."""
        return self.part.counts(self._store, self._streams()).total()

    @property
    def messages_read(self) -> int:
        """Messages of the chosen topics read in this iteration."""
        return self.heard.messages

    @property
    def counts(self) -> dict[str, int]:
        """What was read, corrected and dropped so far: scans and odometry always, others if not zero."""
        return self.heard.told_counts(self._store.unreadable_messages)

    @property
    def findings(self) -> list[Finding]:
        """Findings about the bag; complete after iterating."""
        return [
            *(Finding("bag_damaged", loss=loss) for loss in self._store.losses),
            *self._store.notes,
            *self._findings,
            *self._place_findings,
            *self._corrections.findings,
            *self.heard.findings(
                self.scan_topic,
                (self.odom_topic, self.imu_topic),
                [by * 1e-9 for _, by in self._store.set_backs],
            ),
        ]

    @property
    def _place_findings(self) -> list[Finding]:
        """Doubts about the places of the sensors, unless corrected."""
        places = self._frames.places.values() if self._corrections.base_from_laser is None else ()
        return [finding for place in places for finding in place.findings]

    @property
    def warnings(self) -> list[str]:
        """The findings as sentences for users, with their grades."""
        return [finding.warning for finding in self.findings]

    def require_returns(self) -> None:
        """Raises UserError when no beam of the scans read so far hit anything."""
        if self.heard.scans.count and self.heard.scans.farthest == 0.0:
            told = " ".join(finding.sentence for finding in self.findings if finding.spoils_map)
            raise UserError(f"{self.path} shows nothing: {told}")

    def __iter__(self) -> Iterator[Measurement]:
        if self._is_closed:
            raise UserError(f"The reader of {self.path} is closed; open the bag again.")
        self.heard = heard = Heard()
        ordered = in_order(self._items(), heard.counts)
        items: Iterator[Measurement] = (item for item in ordered if not heard.is_spike(item))
        if self._motion.odometry is not None or self._motion.imu is not None:
            items = after_their_motion(items, heard.counts, has_odometry=self._motion.odometry is not None)
        yield from (item for item in items if heard.takes(item))
        if not heard.counts["scans"]:
            why = " ".join(finding.sentence for finding in self.findings)
            raise UserError(f"{self.path} holds no usable scan on {self.scan_topic}: {why}")

    def _open_scans(self, named: Sequence[str]) -> None:
        topics = self._store.topics
        chosen = choose_scans(
            topics,
            tuple(SCAN_CONVERTERS),
            named,
            lambda topic: first_samples(self._store, topic).messages,
            self._findings,
        )
        if not chosen:
            losses = "".join(f" {sentence}" for sentence in self._store.losses)
            raise UserError(
                f"{self.path} holds no laser scans ({_type_names(SCAN_CONVERTERS)}); "
                f"its topics are {list_topics(topics)}.{losses}"
            )
        self._scans = [first_samples(self._store, topic) for topic in chosen]
        for samples in self._scans:
            if not samples.messages:
                raise UserError(f"Not one scan of {samples.topic.name} in {self.path} can be read.")
            single_echo = SINGLE_ECHOES.get(samples.topic.message_type)
            if single_echo is not None:
                messages = (message for _, _, message in decoded(self._store, [samples.topic.name]))
                reading, findings = learn_reading(map(single_echo, messages))
                self._readings[samples.topic.name] = reading
                self._findings.extend(findings)

    @property
    def _scan_frame(self) -> str:
        return self._scans[0].frames[0]

    def _streams(self) -> list[str]:
        """Topics that are read."""
        of_imu = [self._motion.imu.topic.name] if self._motion.imu else []
        return list(dict.fromkeys([*self.scan_topics, *self._motion.odometry_topics, *of_imu]))

    def _items(self) -> Iterator[Measurement]:
        """Measurements in the order of recording."""
        converters, clocks = self._converters(), self._clocks()
        corrector = Corrector(self._corrections)
        for name, recorded, data in self.part.messages(self._store, list(clocks)):
            self.heard.messages += 1
            message = decode_or_count(self._store.topics[name], data, self.heard.counts)
            header = None if message is None else stamp_of(message, converters[name])
            if message is None or header is None:
                continue
            self.heard.note_stamp(name, header, recorded)
            settled = clocks[name].stamped((name, message), header, recorded)
            yield from map(corrector.correct, _converted(settled, converters))
        for clock in dict.fromkeys(clocks.values()):
            yield from map(corrector.correct, _converted(clock.rest(), converters))

    def _converters(self) -> dict[str, Converter[Measurement]]:
        """Converters by topic."""
        numbers: dict[tuple[str, str], int] = {}
        converters: dict[str, Converter[Measurement]] = {
            samples.topic.name: FramedScanConverter(
                samples.topic.name, partial(self._new_scan_converter, samples), numbers
            )
            for samples in self._scans
        }
        if self._motion.odometry is not None:
            converter = self._motion.odometry_converter(self.heard.counts)
            converters |= dict.fromkeys(self._motion.odometry_topics, converter)
        if self._motion.imu is not None:
            topic, frame = self._motion.imu.topic, self._motion.imu.frames[0]
            base_from_imu = self._frames.between(self._frames.placed(self._scan_frame).base_frame, frame)
            converters[topic.name] = YAW_RATE_CONVERTERS[topic.message_type](base_from_imu, self.heard.counts)
        return converters

    def _new_scan_converter(self, samples: Samples, frame: str) -> Converter[Scan]:
        place = self._frames.placed(frame)
        setup = ScanSetup(
            place,
            longest_sweep=min(_LONGEST_SWEEP, 1.5 * samples.gap(frame)),
            points_are_in_base=frame == place.base_frame,
            reading=self._readings.get(samples.topic.name, AS_STATED),
            config=self.sensors,
        )
        return SCAN_CONVERTERS[samples.topic.message_type](setup, self.heard.counts)

    def _clocks(self) -> dict[str, RecordedStamps[tuple[str, Any]]]:
        """A clock for each chosen topic; a topic without stamps of its own uses that of the other."""
        chosen = [*self._scans, *(each for each in (self._motion.imu, self._motion.odometry) if each)]
        known = [samples.clock_offset for samples in chosen if samples.clock_offset is not None]
        shared = self.heard.clock = SteadyClock(offset=known[0] if known else 0)
        clocks: dict[str, RecordedStamps[tuple[str, Any]]] = {
            samples.topic.name: RecordedStamps(
                shared, self.heard.counts, trusts_headers=samples.clock_offset is not None
            )
            for samples in chosen
        }
        for name in self._streams():
            clocks.setdefault(name, clocks[chosen[-1].topic.name])
        return clocks


def _converted(
    settled: Iterable[tuple[tuple[str, Any], int]], converters: Mapping[str, Converter[Measurement]]
) -> Iterator[Measurement]:
    """Convert stamped messages, each paired with its topic."""
    for (name, message), stamp in settled:
        item = converters[name].convert(message, stamp)
        if item is not None:
            yield item


def _type_names(message_types: Iterable[str]) -> str:
    """Type names for users, such as "LaserScan or PointCloud2"."""
    *others, last = (name.rpartition("/")[2] for name in message_types)
    return f"{', '.join(others)} or {last}" if others else last
