"""One laser of the car as known so far: its place, how to interpret its numbers, and its clock."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from racecar.pipelines.bags.converters.framed_scans import of_laser
from racecar.pipelines.bags.converters.registry import SCAN_CONVERTERS, SINGLE_ECHOES, Converter
from racecar.pipelines.bags.converters.scan_reading import (
    AS_STATED,
    ScanReading,
    ScanSetup,
    learn_reading,
)
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.pipelines.bags.messages import nanoseconds, type_name
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.clocks.topic_clock import TopicClock
from racecar.sensors.config import SensorConfig
from racecar.sensors.findings import Finding, in_words
from racecar.sensors.scan import Scan

ASSUMED = SensorPlace(np.eye(4), "assumed identity")
REMEMBERED = "the last run"
_LONGEST_SWEEP = 0.25
"""Seconds; beam times that imply a longer sweep are ignored, since the slowest scanners with such times turn
five times a second."""
_LATE_TRANSFORM = 1.0
"""Seconds by which a transform may arrive after the first scan before that is reported. Chosen by judgement,
since DDS discovers publishers one after the other."""
_KEPT_EVERY = 100_000_000
"""Nanoseconds between two stored messages, long enough to show the car at several places."""
_LEARNED_AT = (10, 40, 160)
"""Numbers of stored messages, after 1, 4 and 16 seconds, at which all are analysed: the first to correct
misinterpreted numbers soon, the last to rely on a drive."""
_SOON = 20
"""Messages that suffice to choose an interpretation of the numbers, since each shows several walls."""


class Laser:
    """Converts a laser's messages to scans; its faults are reported and tolerated."""

    def __init__(
        self,
        frame: str,
        number: int,
        clock: TopicClock,
        config: SensorConfig,
        faults: Faults,
        aside: Callable[[Callable[[], None]], None],
    ) -> None:
        """``config`` filters the readings; ``aside`` runs work in another thread."""
        self._config = config
        self.frame, self._number, self.clock, self._faults, self._aside = frame, number, clock, faults, aside
        self.placed: SensorPlace | None = None
        """The laser's place; None while it is unknown."""
        self._unplaced_since: float | None = time.monotonic()
        """Monotonic time in seconds; None once its place has been reported."""
        self._reading = AS_STATED
        self._kept: list[tuple[int, Any]] = []
        self._setup: tuple[SensorPlace | None, ScanReading] = (None, AS_STATED)
        self._converters: dict[str, Converter[Scan]] = {}

    def stamp(self, message: Any, arrival: int) -> int | None:
        """The steady stamp of a message that arrived at a time (nanoseconds); None if its own stamp is an
        outlier. Also learns from the first messages."""
        self._keep(message, arrival)
        return self.clock.steady(nanoseconds(message.header.stamp), arrival, sweep(message))

    def scan(self, message: Any, stamp: int, counts: Counter[str], base_frame: str) -> Scan | None:
        """The scan of a message; None if it holds none. Corrections are counted in ``counts``; ``base_frame``
        is the car's while there is no transform."""
        if self._unplaced_since is not None and time.monotonic() - self._unplaced_since > _LATE_TRANSFORM:
            self._report_place(base_frame)
        scan = self._converter(type_name(message), counts).convert(message, stamp)
        return None if scan is None else of_laser(scan, self._number)

    def place_at(self, placed: SensorPlace | None, base_frame: str) -> None:
        """Set its place, as far as it is known."""
        before = self.placed
        if _is_same(placed, before):
            return
        self.placed = placed
        if before is not None and placed is not None and _has_moved(before, placed):
            finding = Finding(
                "laser_moved",
                laser=self.frame,
                place=in_words(placed.pose),
                base=placed.base_frame,
                before=in_words(before.pose),
            )
            self._faults.find(finding, key=f"{self.frame} moved", lasting=False)
        self._report_place(base_frame)

    def learn_first(self, messages: Sequence[Any]) -> bool:
        """Learn from its first messages how to interpret the numbers; False if more messages are needed."""
        reading, findings = learn_reading(messages)
        if findings and len(messages) < _SOON:
            return False
        self._read_as(reading, findings)
        return True

    def _keep(self, message: Any, arrival: int) -> None:
        """Learn, in another thread, from the first messages some time apart."""
        kept, single_echo = self._kept, SINGLE_ECHOES.get(type_name(message))
        if single_echo is None or len(kept) >= _LEARNED_AT[-1]:
            return
        if kept and arrival - kept[-1][0] < _KEPT_EVERY:
            return
        kept.append((arrival, single_echo(message)))
        if len(kept) in _LEARNED_AT:
            messages = [each for _, each in kept]
            self._aside(lambda: self._read_as(*learn_reading(messages)))
        if len(kept) == _LEARNED_AT[-1]:
            kept[:] = [(arrival, None)] * len(kept)

    def _read_as(self, reading: ScanReading, findings: Sequence[Finding]) -> None:
        self._reading, key = reading, f"reading of {self.frame}"
        if findings:
            self._faults.find(*findings, key=key)
        else:
            self._faults.end(key, f"The scans of {self.frame} are read as they stand.")

    def _converter(self, message_type: str, counts: Counter[str]) -> Converter[Scan]:
        if self._setup != (setup := (self.placed, self._reading)):
            self._setup, self._converters = setup, {}
        if message_type not in self._converters:
            placed, reading = setup
            self._converters[message_type] = SCAN_CONVERTERS[message_type](
                ScanSetup(
                    ASSUMED if placed is None else placed,
                    longest_sweep=_LONGEST_SWEEP,
                    points_are_in_base=placed is not None and self.frame == placed.base_frame,
                    reading=reading,
                    config=self._config,
                ),
                counts,
            )
        return self._converters[message_type]

    def _report_place(self, base_frame: str) -> None:
        self._unplaced_since, placed, key = None, self.placed, f"place of {self.frame}"
        if placed is None:
            told = [Finding("no_transform", laser=self.frame or "the laser", base=base_frame)]
        elif placed.source == REMEMBERED:
            told = [Finding("no_transform_yet", laser=self.frame, base=placed.base_frame)]
        else:
            told = list(placed.findings)
        if told:
            self._faults.find(*told, key=key)
        elif placed is not None:
            self._faults.end(key, f"The place of {self.frame} is known now, from {placed.source}.")


def sweep(message: Any) -> int:
    """Nanoseconds from the stamp of a scan message to its last beam, 0 if unknown."""
    seconds = getattr(message, "time_increment", 0.0) * (len(getattr(message, "ranges", ())) - 1)
    return round(seconds * 1e9) if 0.0 < seconds <= _LONGEST_SWEEP else 0


def _is_same(placed: SensorPlace | None, before: SensorPlace | None) -> bool:
    if placed is None or before is None:
        return placed is before
    return (
        (placed.base_frame, placed.source) == (before.base_frame, before.source)
        and placed.findings == before.findings
        and np.array_equal(placed.base_from_sensor, before.base_from_sensor)
    )


def _has_moved(before: SensorPlace, placed: SensorPlace) -> bool:
    """Whether a known transform has changed."""
    is_of_one = before.is_sure and before.base_frame == placed.base_frame
    return is_of_one and not np.array_equal(before.base_from_sensor, placed.base_from_sensor)
