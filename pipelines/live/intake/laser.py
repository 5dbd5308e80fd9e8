"""One laser of the car, as it is known by now: where it sits, how its numbers are meant, and its clock."""

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
"""Seconds; beam times that make a sweep longer are not believed, as the slowest scanners with such times turn
five times a second."""
_LATE_TRANSFORM = 1.0
"""Seconds for which a transform may come later than the first scan, as DDS finds publishers one after the
other, before that is reported: by judgement."""
_KEPT_EVERY = 100_000_000
"""Nanoseconds between two messages that are kept, so that these show the car at several places."""
_LEARNED_AT = (10, 40, 160)
"""Messages that are kept when all of them are looked at, after 1, 4 and 16 seconds: the first time, so that
what cannot be meant as it stands is soon read otherwise; the last, so that it rests on a drive."""
_SOON = 20
"""Messages that are enough to tell apart what the numbers may mean, since each shows several walls."""


class Laser:
    """Makes scans of its messages; what is wrong with it is reported and tolerated."""

    def __init__(
        self,
        frame: str,
        number: int,
        clock: TopicClock,
        config: SensorConfig,
        faults: Faults,
        aside: Callable[[Callable[[], None]], None],
    ) -> None:
        """``config`` says what of the readings counts; ``aside`` lets another thread do some work."""
        self._config = config
        self.frame, self._number, self.clock, self._faults, self._aside = frame, number, clock, faults, aside
        self.placed: SensorPlace | None = None
        """Where it sits; None while nothing tells."""
        self._unplaced_since: float | None = time.monotonic()
        """None once people were told of its place."""
        self._reading = AS_STATED
        self._kept: list[tuple[int, Any]] = []
        self._setup: tuple[SensorPlace | None, ScanReading] = (None, AS_STATED)
        self._converters: dict[str, Converter[Scan]] = {}

    def stamp(self, message: Any, arrival: int) -> int | None:
        """The steady stamp of a message that arrived at a time (nanoseconds); None where its own went astray.
        The first messages are learned from."""
        self._keep(message, arrival)
        return self.clock.steady(nanoseconds(message.header.stamp), arrival, sweep(message))

    def scan(self, message: Any, stamp: int, counts: Counter[str], base_frame: str) -> Scan | None:
        """The scan of a message; None where it holds none. What is mended goes into ``counts``;
        ``base_frame``: that of the car as long as no transform tells."""
        if self._unplaced_since is not None and time.monotonic() - self._unplaced_since > _LATE_TRANSFORM:
            self._report_place(base_frame)
        scan = self._converter(type_name(message), counts).convert(message, stamp)
        return None if scan is None else of_laser(scan, self._number)

    def place_at(self, placed: SensorPlace | None, base_frame: str) -> None:
        """Where it sits, as far as known by now."""
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
        """Learn at once from its first messages how the numbers are meant; False where more of them are
        needed."""
        reading, findings = learn_reading(messages)
        if findings and len(messages) < _SOON:
            return False
        self._read_as(reading, findings)
        return True

    def _keep(self, message: Any, arrival: int) -> None:
        """Learn, aside, from the first messages that are some time apart."""
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
    """Nanoseconds from the stamp of a scan's message to its last beam, as far as it says."""
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
    """Whether a transform that was known by now was changed."""
    is_of_one = before.is_sure and before.base_frame == placed.base_frame
    return is_of_one and not np.array_equal(before.base_from_sensor, placed.base_from_sensor)
