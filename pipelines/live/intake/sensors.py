"""Convert sensor messages to scans and odometry, with the same converters that read bags."""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.car_frames import CarFrames
from racecar.pipelines.bags.converters.odometry import planar_pose, planar_twist
from racecar.pipelines.bags.converters.registry import (
    ODOMETRY_CONVERTERS,
    SINGLE_ECHOES,
    YAW_RATE_CONVERTERS,
    Converter,
)
from racecar.pipelines.bags.converters.transforms import FrameLinks, SensorPlace
from racecar.pipelines.bags.messages import (
    TRANSFORMS,
    frame_name,
    nanoseconds,
    ros2_types,
    type_name,
)
from racecar.pipelines.bags.odometry_spikes import OdometrySpikes
from racecar.pipelines.bags.repeated_scans import RepeatedScans
from racecar.pipelines.live.intake.clock_faults import ClockFaults
from racecar.pipelines.live.intake.first_messages import Arrived
from racecar.pipelines.live.intake.laser import ASSUMED, REMEMBERED, Laser, sweep
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.clocks.topic_clock import ClockReports, SteadyClock, TopicClock
from racecar.sensors.config import SensorConfig
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_MOVING_SPEED = 0.05
"""m/s or rad/s above which the car moves. Chosen by judgement."""
_MOVING_MESSAGES = 40
"""Messages of a moving car with a constant pose until reported, about a second. Chosen by judgement."""
_NEAR = 0.25
"""Share of the offset between the clocks of scans and odometry: if the odometry's is this close to the
computer's clock, the scans' is wrong. Chosen by judgement, since messages arrive with a delay."""
_MENDED = (
    "empty_scans",
    "scans_beyond_one_turn",
    "scans_without_range_max",
    "time_increments_ignored",
    "invalid_yaw_rates",
)
"""The converters' counts that are reported."""
_NO_TRANSFORMS = bytes([0, 1, 0, 0, 0, 0, 0, 0])
"""A serialized message without transforms."""


class Sensors:
    """Scans and odometry with steady stamps; faults are reported and tolerated."""

    def __init__(
        self,
        *,
        base_frame: str,
        laser_pose: Pose | None,
        integrate_twist: bool,
        faults: Faults,
        aside: Callable[[Callable[[], None]], None],
        config: SensorConfig | None = None,
    ) -> None:
        """``laser_pose`` (3,) overrides transforms; ``integrate_twist``: use only the speeds of odometry;
        ``aside`` runs work in another thread; ``config`` filters the readings."""
        self._base_frame, self._faults, self._aside = base_frame, faults, aside
        self._config = config or SensorConfig()
        links = FrameLinks(takes_mended=True)
        self.frames = CarFrames(laser_pose, "the parameter laser_pose", base_frame, links)
        """The car's frames, as they are published."""
        self._known_version = 0
        self._lasers: dict[str, Laser] = {}
        """By frame, in the order of their first messages."""
        self._remembered: LaserPlace | None = None
        self._repeats, self._spikes = RepeatedScans(), OdometrySpikes()
        self._integrate_twist = integrate_twist
        self._clock = SteadyClock(time.time_ns() - time.monotonic_ns())
        reports = ClockFaults(
            "odometry", faults, is_other_wrong=lambda: any(map(self._ahead_by_fault, list(self._lasers)))
        )
        self._odometry_clock = TopicClock(self._clock, reports)
        self._odometry_ahead = 0
        self._judged: dict[str, tuple[int, int]] = {}
        self._imu_clock = TopicClock(self._clock, ClockFaults("IMU's messages", faults))
        self._imu_version = -1
        self._odometry_converters: dict[str, Converter[Odometry]] = {}
        self._imu_converters: dict[tuple[str, str], Converter[YawRate]] = {}
        self._counts: Counter[str] = Counter()
        """Corrections to messages; each kind is reported once."""
        self._mended: set[str] = set()
        self._known_correction = 0
        self._standing: Pose | None = None
        self._moving_messages = 0
        ros2_types().deserialize_cdr(_NO_TRANSFORMS, TRANSFORMS)  # so slow at first that scans pile up

    @property
    def place(self) -> LaserPlace | None:
        """The first laser's place, None until it is known."""
        first = self._first
        if first is None or first.placed is None:
            return None
        return LaserPlace(first.placed.base_frame, first.frame, first.placed.base_from_sensor)

    @property
    def first_place(self) -> SensorPlace:
        """The first laser's place, assumed if it is unknown."""
        first = self._first
        return ASSUMED if first is None or first.placed is None else first.placed

    @property
    def base_frame(self) -> str:
        """The frame whose pose is estimated."""
        return next((each.base_frame for each in self._places if each is not None), self._base_frame)

    @property
    def scan_frames(self) -> list[str]:
        """Frames of the lasers heard so far."""
        return list(self._lasers)

    @property
    def rests_on_tf(self) -> bool:
        """Whether a laser's place comes from ``/tf``, the topic of links that may move."""
        return any(each is not None and each.source == "tf" for each in self._places)

    @property
    def misses_place(self) -> bool:
        """Whether the place of a laser that sends scans is not known from this run."""
        return any(each is None or not each.is_sure for each in self._places)

    @property
    def _first(self) -> Laser | None:
        return next(iter(self._lasers.values()), None)

    @property
    def _places(self) -> list[SensorPlace | None]:
        return [laser.placed for laser in list(self._lasers.values())]

    def remember_place(self, place: LaserPlace) -> None:
        """Set the laser's place from an earlier run, to be used until transforms arrive, which may take
        seconds."""
        self._remembered = place
        self.frames.version += 1

    def carry_on(self, last_stamp: int) -> None:
        """Continue the drive: later messages get stamps after ``last_stamp`` (nanoseconds)."""
        self._clock.after = last_stamp

    def knows_place(self, scan_message: Any) -> bool:
        """Whether the place of a message's laser is known and need not be assumed."""
        placed = self._placed(frame_name(scan_message.header.frame_id))
        return placed is not None and (placed.is_sure or placed.source == REMEMBERED)

    def was_corrected(self) -> bool:
        """Whether the odometry's stamps were corrected since the last call."""
        before, self._known_correction = self._known_correction, self._odometry_clock.correction
        return before != self._known_correction

    @property
    def odometry_behind(self) -> float:
        """Seconds by which the odometry's headers are behind those of the scans, as far as detected."""
        first = self._first
        return 0.0 if first is None else (self._odometry_clock.behind - first.clock.behind) * 1e-9

    def clock_error(self, message: Any) -> int:
        """Nanoseconds by which a scan's header is ahead if its clock is known to be wrong: it disagrees with
        the odometry's, which agrees with this computer's."""
        frame = frame_name(message.header.frame_id)
        is_stamped = bool(nanoseconds(message.header.stamp))
        return self._ahead_by_fault(frame) if is_stamped and frame in self._lasers else 0

    def compare_clocks(self, messages: Iterable[Arrived]) -> bool:
        """Estimate the offset between the clocks of scans and odometry from the first messages, and correct
        it for all of them; False while it is uncertain."""
        shared, silent = SteadyClock(), ClockReports()
        scans, odometry = TopicClock(shared, silent, is_reference=True), TopicClock(shared, silent)
        first_frame: str | None = None
        for is_scan, message, arrival in messages:
            header = nanoseconds(message.header.stamp)
            if not is_scan:
                odometry.steady(header, arrival)
                self._odometry_ahead = _ahead(header, arrival)
            elif first_frame in (None, frame := frame_name(message.header.frame_id)):
                first_frame = frame
                scans.steady(header, arrival, sweep(message))
        if first_frame is not None and _is_right(self._odometry_ahead, odometry.correction):
            self._laser(first_frame).clock.correct(-odometry.correction)
        elif odometry.correction:
            self._odometry_clock.correct(odometry.correction)
        return bool(odometry.correction) or odometry.agrees

    def understands(self, messages: Sequence[Arrived]) -> bool:
        """Whether the interpretation of the first messages, their numbers and stamps, is certain."""
        return self.reads(messages) and self.compare_clocks(messages)

    def reads(self, messages: Iterable[Arrived]) -> bool:
        """Whether the interpretation of the first scans' numbers is certain."""
        scans: dict[str, list[Any]] = {}
        for is_scan, message, _ in messages:
            if is_scan and (single_echo := SINGLE_ECHOES.get(type_name(message))) is not None:
                scans.setdefault(frame_name(message.header.frame_id), []).append(single_echo(message))
        return all(self._laser(frame).learn_first(of_frame) for frame, of_frame in scans.items())

    def scan(self, message: Any, arrival: int) -> Scan | None:
        """The scan of a message that arrived at a time (nanoseconds); None if it is to be dropped."""
        laser = self._laser(frame_name(message.header.frame_id))
        stamp, beams_changed = laser.stamp(message, arrival), self._counts["changed_beam_counts"]
        if stamp is None:
            return None
        scan = laser.scan(message, stamp, self._counts, self._base_frame)
        self._report_mended()
        if scan is not None and self._counts["changed_beam_counts"] > beams_changed:
            self._faults.find(Finding("beams_changed", beams=len(scan.ranges)), lasting=False)
        if scan is None or np.isnan(scan.ranges).all():
            self._faults.find(Finding("scans_without_readings"), key="blind")
        elif not scan.is_return.any():
            self._faults.find(Finding("scans_see_nothing", metres=scan.max_range), key="blind")
        else:
            self._faults.end("blind", "The scans hold readings again.")
        return None if scan is None or self._is_repeat(scan) else scan

    def odometry(self, message: Any, arrival: int) -> Odometry | None:
        """The sample of a message that arrived at a time (nanoseconds); None if it holds none."""
        header = nanoseconds(message.header.stamp)
        self._odometry_ahead = _ahead(header, arrival)
        stamp = self._odometry_clock.steady(header, arrival)
        if stamp is None:
            return None
        kind = type_name(message)
        if kind not in self._odometry_converters:
            new_converter = ODOMETRY_CONVERTERS[kind]
            self._odometry_converters[kind] = new_converter(self._integrate_twist, self._counts)
        sample = self._odometry_converters[kind].convert(message, stamp)
        finding, ended = Finding("poses_not_numbers"), "The odometry holds poses again."
        self._faults.judge(sample is None, finding, ended)
        if sample is None:
            return None
        if self._spikes.is_spike(sample):
            self._faults.find(Finding("samples_jump_away"), lasting=False)
            return None
        self._repeats.add_odometry(sample)
        if not self._integrate_twist:
            self._watch_poses(message)
        return sample

    def yaw_rate(self, message: Any, arrival: int) -> YawRate | None:
        """The sample of an IMU message that arrived at a time (nanoseconds); None if it holds none."""
        stamp = self._imu_clock.steady(nanoseconds(message.header.stamp), arrival)
        sample = None if stamp is None else self._imu_converter(message).convert(message, stamp)
        self._report_mended()
        return sample

    def _report_mended(self) -> None:
        """Report once each kind of dropped or corrected message."""
        for name in _MENDED:
            if name not in self._mended and self._counts[name]:
                self._mended.add(name)
                self._faults.find(Finding(name, count=self._counts[name]), lasting=False)

    def _is_repeat(self, scan: Scan) -> bool:
        is_repeat = self._repeats.is_repeat(scan)
        ended = "The scans show something new again."
        self._faults.judge(self._repeats.is_stuck, Finding("scans_repeat"), ended)
        return is_repeat

    def _imu_converter(self, message: Any) -> Converter[YawRate]:
        """The converter for the message's type and the IMU's frame, which gives its mount."""
        if self._imu_version != self.frames.version:
            self._imu_version = self.frames.version
            self._imu_converters.clear()
        kind, frame = key = type_name(message), frame_name(message.header.frame_id)
        if key not in self._imu_converters:
            base_from_imu = self.frames.between(self.base_frame, frame)
            self._imu_converters[key] = YAW_RATE_CONVERTERS[kind](base_from_imu, self._counts)
        return self._imu_converters[key]

    def _laser(self, frame: str) -> Laser:
        """The laser of a frame, which may differ between scans; the first one's clock is the drive's."""
        if frame not in self._lasers:
            is_first = not self._lasers
            what, other = ("scans", "odometry") if is_first else (f"scans of {frame}", "scans")
            reports = ClockFaults(what, self._faults, other)
            clock = TopicClock(self._clock, reports, is_reference=is_first)
            laser = Laser(frame, len(self._lasers), clock, self._config, self._faults, self._aside)
            laser.place_at(self._placed(frame), self._base_frame)
            self._lasers[frame] = laser
        if self._known_version != self.frames.version:
            self._known_version = self.frames.version
            for laser in self._lasers.values():
                laser.place_at(self._placed(laser.frame), self._base_frame)
        return self._lasers[frame]

    def _placed(self, frame: str) -> SensorPlace | None:
        placed, last = self.frames.placed(frame), self._remembered
        if placed.base_frame:
            return placed
        if last is None or last.laser_frame != frame:
            return None
        return SensorPlace(last.base_from_laser, REMEMBERED, last.base_frame)

    def _watch_poses(self, message: Any) -> None:
        """Detect drivers that fill in the speeds only."""
        pose = planar_pose(message)
        if pose is None:
            return
        if self._standing is None or not np.array_equal(pose, self._standing):
            self._standing, self._moving_messages = pose, 0
            self._faults.end("poses_stand", "The odometry's poses move again.")
        elif np.abs(planar_twist(message)).max() > _MOVING_SPEED:
            self._moving_messages += 1
            if self._moving_messages == _MOVING_MESSAGES:
                self._faults.find(Finding("poses_stand"))

    def _ahead_by_fault(self, frame: str) -> int:
        """Nanoseconds by which a laser's clock is ahead of the odometry's, if the laser's is wrong. Judged
        only when the clocks are compared, since messages may be late at other times."""
        ahead = self._odometry_clock.behind - self._lasers[frame].clock.behind
        judged, fault = self._judged.get(frame, (0, 0))
        if ahead != judged:
            fault = ahead if _is_right(self._odometry_ahead, ahead) else 0
            self._judged[frame] = ahead, fault
        return fault


def _ahead(header: int, arrival: int) -> int:
    """Nanoseconds by which a header is ahead of this computer's time on arrival."""
    return header - arrival - (time.time_ns() - time.monotonic_ns())


def _is_right(ahead: int, disagreement: int) -> bool:
    """Whether a clock this far ahead of this computer's is the right one of two that disagree."""
    return abs(ahead) < _NEAR * abs(disagreement)
