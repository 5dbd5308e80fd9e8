"""Scans of several sensors on one topic, each placed by its own frame."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from racecar.pipelines.bags.converters.registry import Converter
from racecar.pipelines.bags.messages import frame_name
from racecar.sensors.scan import Scan

_MOST_FRAMES = 16
"""Most frames on one topic. No car has more lasers; a driver that numbers the frames of its scans has one."""


class FramedScanConverter:
    """Passes each message to the converter of its frame. Sensors are numbered in the order of their first
    scans."""

    def __init__(
        self,
        topic: str,
        new_converter: Callable[[str], Converter[Scan]],
        numbers: dict[tuple[str, str], int],
    ) -> None:
        """``new_converter`` makes the converter of a frame. ``numbers`` maps topic and frame to the sensor's
        number and is shared by all topics."""
        self._topic = topic
        self._new_converter = new_converter
        self._numbers = numbers
        self._converters: dict[str, Converter[Scan]] = {}

    def convert(self, message: Any, stamp: int) -> Scan | None:
        """The scan; None if the message has no usable beams."""
        frame = frame_name(message.header.frame_id)
        if frame not in self._converters and len(self._converters) == _MOST_FRAMES:
            frame = next(iter(self._converters))
        if frame not in self._converters:
            self._converters[frame] = self._new_converter(frame)
        scan = self._converters[frame].convert(message, stamp)
        if scan is None:
            return None
        laser = self._numbers.setdefault((self._topic, frame), len(self._numbers))
        return of_laser(scan, laser)


def of_laser(scan: Scan, laser: int) -> Scan:
    """A copy of a scan with the number of the laser that took it.

    Scans of synchronized sensors are shifted by a nanosecond each, so no two scans have the same stamp.
    """
    return scan if laser == 0 else replace(scan, laser=laser, stamp=scan.stamp + laser)
