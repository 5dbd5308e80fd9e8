"""How the numbers in the lasers' messages are meant, learned from the first of them while the car drives."""

from collections.abc import Callable, Sequence
from typing import Any

from racecar.pipelines.bags.converters.scan_reading import AS_STATED, ScanReading, learn_reading
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.findings import Finding

_EVERY = 100_000_000
"""Nanoseconds between two messages that are kept, so that these show the car at several places."""
_LEARNED_AT = (10, 40, 160)
"""Messages that are kept when all of them are looked at, after 1, 4 and 16 seconds: the first time, so that
what cannot be meant as it stands is soon read otherwise; the last, so that it rests on a drive."""
_SOON = 20
"""Messages that are enough to tell apart what the numbers may mean, since each shows several walls."""


class ScanReadings:
    """Learns aside, and says when a laser is to be read otherwise."""

    def __init__(self, faults: Faults, aside: Callable[[Callable[[], None]], None]) -> None:
        """``aside`` lets another thread do some work."""
        self._faults, self._aside = faults, aside
        self._kept: dict[str, list[tuple[int, Any]]] = {}
        self._readings: dict[str, ScanReading] = {}
        self.version = 0
        """Grows when a reading changes."""

    def reading(self, frame: str) -> ScanReading:
        """Of the laser with a frame, as known by now."""
        return self._readings.get(frame, AS_STATED)

    def take(self, frame: str, arrival: int, scan: Callable[[], Any]) -> None:
        """Keep a LaserScan, which is made where it is one of the first; it arrived at a time in
        nanoseconds."""
        kept = self._kept.setdefault(frame, [])
        if len(kept) >= _LEARNED_AT[-1] or (kept and arrival - kept[-1][0] < _EVERY):
            return
        kept.append((arrival, scan()))
        if len(kept) in _LEARNED_AT:
            messages = [each for _, each in kept]
            self._aside(lambda: self._learn(frame, messages))
        if len(kept) == _LEARNED_AT[-1]:
            kept[:] = [(arrival, None)] * len(kept)

    def learn_first(self, frame: str, messages: Sequence[Any]) -> bool:
        """Learn at once from the first messages; False where more of them are needed."""
        reading, findings = learn_reading(messages)
        if findings and len(messages) < _SOON:
            return False
        self._apply(frame, reading, findings)
        return True

    def _learn(self, frame: str, messages: Sequence[Any]) -> None:
        self._apply(frame, *learn_reading(messages))

    def _apply(self, frame: str, reading: ScanReading, findings: Sequence[Finding]) -> None:
        if reading != self.reading(frame):
            self._readings[frame] = reading
            self.version += 1
        name = f"reading of {frame}"
        if findings:
            self._faults.find(*findings, key=name)
        else:
            self._faults.end(name, f"The scans of {frame} are read as they stand.")
