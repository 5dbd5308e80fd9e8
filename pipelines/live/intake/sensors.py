"""Messages of the car's sensors to scans and odometry, by the same converters that read bags."""

import time
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.converters.odometry import planar_pose, planar_twist
from racecar.pipelines.bags.converters.point_clouds import SECTION_HEIGHTS
from racecar.pipelines.bags.converters.registry import (
    ODOMETRY_CONVERTERS,
    SCAN_CONVERTERS,
    Converter,
    OdometrySetup,
    ScanSetup,
)
from racecar.pipelines.bags.converters.transforms import SensorPlace, TransformTree
from racecar.pipelines.bags.messages import TRANSFORMS, frame_name, nanoseconds, ros2_types, type_name
from racecar.pipelines.live.intake.clock_faults import ClockFaults, NoReports
from racecar.pipelines.live.intake.first_messages import Arrived
from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.pipelines.live.intake.steady_clock import SteadyClock, TopicClock
from racecar.pipelines.live.monitoring.faults import Faults

_REMEMBERED = "the last run"
_LONGEST_SWEEP = 0.25
"""Seconds; beam times that make a sweep longer are not believed, as the slowest scanners with such times turn
five times a second."""
_MOVING_SPEED = 0.05
"""m/s or rad/s above which the car moves: by judgement."""
_MOVING_MESSAGES = 40
"""Messages of a moving car whose pose stands still until that is reported, about a second: by judgement."""
_NO_TRANSFORMS = bytes([0, 1, 0, 0, 0, 0, 0, 0])
"""A serialized message without any."""


class Sensors:
    """Scans and odometry with steady stamps; what is wrong with them is reported and tolerated."""

    def __init__(
        self,
        *,
        base_frame: str,
        laser_pose: Pose | None,
        integrate_twist: bool,
        after: int | None,
        faults: Faults,
    ) -> None:
        """``laser_pose`` (3,) overrides ``/tf_static``; ``integrate_twist``: only odometry's speeds count;
        ``after``: the last stamp of a drive that is continued."""
        self._base_frame = base_frame
        self._laser_pose = laser_pose
        self._faults = faults
        self._tree = TransformTree()
        self._place: LaserPlace | None = None
        self._remembered: LaserPlace | None = None
        self._misses_place = False
        self._scan_converters: dict[tuple[str, str], Converter[Scan]] = {}
        self._scan_counts: Counter[str] = Counter()
        self._odometry_counts: Counter[str] = Counter()
        self._integrate_twist = integrate_twist
        self._odometry_converters: dict[str, Converter[Odometry]] = {}
        self._clock = SteadyClock(after, time.time_ns() - time.monotonic_ns())
        self._scan_clocks: dict[str, TopicClock] = {}
        self._odometry_clock = TopicClock(self._clock, ClockFaults("odometry", faults))
        self._standing: Pose | None = None
        self._moving_messages = 0
        self.take_transforms(_NO_TRANSFORMS)  # the first one takes long enough for scans to pile up

    @property
    def place(self) -> LaserPlace | None:
        """Where the laser sits, once that is known."""
        return self._place

    @property
    def misses_place(self) -> bool:
        """Whether scans come from a laser whose place is not known from this run."""
        return self._misses_place

    def remember_place(self, place: LaserPlace) -> None:
        """Where a laser sat when another run ended; it counts until ``/tf_static`` comes, which may take
        seconds."""
        self._remembered = place
        self._scan_converters.clear()

    def knows_place(self, scan_message: Any) -> bool:
        """Whether it is known where the laser of a message sits, so that its scans need no assumption."""
        return self._known_place(frame_name(scan_message.header.frame_id)) is not None

    def take_transforms(self, serialized: bytes) -> None:
        """Fixed transforms, from ``/tf_static``."""
        message = ros2_types().deserialize_cdr(serialized, TRANSFORMS)
        for transform in message.transforms:  # type: ignore[attr-defined]
            self._tree.add(transform)
        self._scan_converters.clear()

    @property
    def odometry_behind(self) -> float:
        """Seconds by which the odometry's headers are behind those of the scans, as far as was noticed."""
        scans = next(iter(self._scan_clocks.values()), None)
        return 0.0 if scans is None else (self._odometry_clock.behind - scans.behind) * 1e-9

    def compare_clocks(self, messages: Iterable[Arrived]) -> bool:
        """Find out from the first messages how the clocks of scans and odometry disagree, so that all of them
        are corrected by that; False while it is in doubt."""
        shared, silent = SteadyClock(), NoReports()
        scans, odometry = TopicClock(shared, silent, is_reference=True), TopicClock(shared, silent)
        first_frame: str | None = None
        for is_scan, message, arrival in messages:
            header = nanoseconds(message.header.stamp)
            if not is_scan:
                odometry.steady(header, arrival)
            elif first_frame in (None, frame := frame_name(message.header.frame_id)):
                first_frame = frame
                scans.steady(header, arrival, _sweep(message))
        if odometry.correction:
            self._odometry_clock.correct(odometry.correction)
        return bool(odometry.correction) or odometry.agrees

    def scan(self, message: Any, arrival: int) -> Scan | None:
        """The scan of a message that arrived at a time (nanoseconds); None where it is to be left out."""
        clock = self._scan_clock(frame_name(message.header.frame_id))
        stamp = clock.steady(nanoseconds(message.header.stamp), arrival, _sweep(message))
        if stamp is None:
            return None
        beams_changed = self._scan_counts["changed_beam_counts"]
        scan = self._scan_converter(message).convert(message, stamp)
        if scan is not None and self._scan_counts["changed_beam_counts"] > beams_changed:
            self._faults.report(
                "beams",
                f"The scans' number of beams changed to {len(scan.ranges)}; they are taken as they come.",
                lasting=False,
            )
        if scan is None or np.isnan(scan.ranges).all():
            self._faults.report(
                "blind",
                "The scans hold no readings (NaN, zero or below range_min): the laser is covered or broken.",
            )
        elif not scan.is_return.any():
            self._faults.report(
                "blind",
                f"The scans see nothing within {scan.max_range:.0f} m: the laser is covered or broken, or no "
                "wall is in its reach.",
            )
        else:
            self._faults.end("blind", "The scans hold readings again.")
        return scan

    def odometry(self, message: Any, arrival: int) -> Odometry | None:
        """The sample of a message that arrived at a time (nanoseconds); None where it holds none."""
        stamp = self._odometry_clock.steady(nanoseconds(message.header.stamp), arrival)
        if stamp is None:
            return None
        sample = self._odometry_converter(message).convert(message, stamp)
        if sample is None:
            self._faults.report(
                "odometry_invalid", "The odometry holds poses that are not numbers; they are left out."
            )
            return None
        self._faults.end("odometry_invalid", "The odometry holds poses again.")
        if not self._integrate_twist:
            self._watch_poses(message)
        return sample

    def _scan_converter(self, message: Any) -> Converter[Scan]:
        """Of the message's type and of the laser's frame, which may differ from scan to scan."""
        key = type_name(message), frame_name(message.header.frame_id)
        if key not in self._scan_converters:
            self._scan_converters[key] = self._new_scan_converter(*key)
        return self._scan_converters[key]

    def _odometry_converter(self, message: Any) -> Converter[Odometry]:
        kind = type_name(message)
        if kind not in self._odometry_converters:
            new_converter = ODOMETRY_CONVERTERS[kind]
            self._odometry_converters[kind] = new_converter(
                OdometrySetup(self._integrate_twist), self._odometry_counts
            )
        return self._odometry_converters[kind]

    def _new_scan_converter(self, message_type: str, frame: str) -> Converter[Scan]:
        place = self._known_place(frame)
        self._place = None if place is None else LaserPlace(self._base_frame, frame, place.base_from_sensor)
        self._misses_place = place is None or place.source == _REMEMBERED
        if place is None:
            self._faults.report(
                "laser_place",
                f"/tf_static does not say where {frame or 'the laser'} sits on {self._base_frame}: it is "
                "taken to be there; publish the transform, or set the parameter laser_pose.",
            )
            place = SensorPlace.from_pose(IDENTITY, "assumed identity")
        elif place.source == _REMEMBERED:
            self._faults.report(
                "laser_place",
                f"/tf_static does not say yet where {frame} sits on {self._base_frame}: it is taken to be "
                "where it was in the last run.",
            )
        else:
            self._faults.end("laser_place", f"The laser's place is known now, from {place.source}.")
        setup = ScanSetup(
            place,
            points_are_in_base=frame == self._base_frame,
            longest_sweep=_LONGEST_SWEEP,
            heights=SECTION_HEIGHTS,
        )
        return SCAN_CONVERTERS[message_type](setup, self._scan_counts)

    def _known_place(self, frame: str) -> SensorPlace | None:
        if self._laser_pose is not None:
            return SensorPlace.from_pose(self._laser_pose, "the parameter laser_pose")
        if frame == self._base_frame:
            return SensorPlace.from_pose(IDENTITY, "base frame")
        matrix = self._tree.between(self._base_frame, frame)
        if matrix is not None:
            return SensorPlace(matrix, "tf_static")
        last = self._remembered
        if last is not None and (last.base_frame, last.laser_frame) == (self._base_frame, frame):
            return SensorPlace(last.base_from_laser, _REMEMBERED)
        return None

    def _watch_poses(self, message: Any) -> None:
        """Some drivers fill the speeds only."""
        pose = planar_pose(message)
        if pose is None:
            return
        if self._standing is None or not np.array_equal(pose, self._standing):
            self._standing, self._moving_messages = pose, 0
            self._faults.end("odometry_stands", "The odometry's poses move again.")
        elif np.abs(planar_twist(message)).max() > _MOVING_SPEED:
            self._moving_messages += 1
            if self._moving_messages == _MOVING_MESSAGES:
                self._faults.report(
                    "odometry_stands",
                    "The odometry's poses stand still while its speeds do not; set the parameter odometry "
                    "to twist.",
                )

    def _scan_clock(self, frame: str) -> TopicClock:
        """Of a laser, which may have a clock of its own; the first one's is that of the drive."""
        if frame not in self._scan_clocks:
            is_first = not self._scan_clocks
            what = "scans" if is_first else f"scans of {frame}"
            self._scan_clocks[frame] = TopicClock(
                self._clock, ClockFaults(what, self._faults), is_reference=is_first
            )
        return self._scan_clocks[frame]


def _sweep(message: Any) -> int:
    """Nanoseconds from the stamp of a scan's message to its last beam, as far as it says."""
    seconds = getattr(message, "time_increment", 0.0) * (len(getattr(message, "ranges", ())) - 1)
    return round(seconds * 1e9) if 0.0 < seconds <= _LONGEST_SWEEP else 0
