"""Replays scans, odometry and yaw rates to a consumer: a mapper, a localizer, or a check of a bag."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class ScanConsumer(Protocol[T_co]):
    """Consumer of measurements in time order."""

    def add_odometry(self, odometry: Odometry) -> None:
        """Add an odometry sample."""

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample."""

    def add_scan(self, scan: Scan) -> T_co:
        """Add a scan; returns the answer to it, such as a pose."""


@dataclass(frozen=True, eq=False)
class Replayed(Generic[T]):
    """A replayed scan and the answer to it."""

    scan: Scan
    answer: T
    seconds: float
    """Time that the answer took."""


def feed(message: Measurement, consumer: ScanConsumer[T]) -> T | None:
    """Pass one message on; returns the answer to a scan, None for others."""
    if isinstance(message, Scan):
        return consumer.add_scan(message)
    if isinstance(message, YawRate):
        consumer.add_yaw_rate(message)
    else:
        consumer.add_odometry(message)
    return None


def replay(
    messages: Iterable[Measurement],
    consumer: ScanConsumer[T],
    clock: Callable[[], float] = time.perf_counter,
) -> Iterator[Replayed[T]]:
    """Replay all messages; yields every scan with its answer, timed by a ``clock`` in seconds."""
    for message in messages:
        if isinstance(message, Scan):
            began = clock()
            answer = consumer.add_scan(message)
            yield Replayed(message, answer, clock() - began)
        else:
            feed(message, consumer)
