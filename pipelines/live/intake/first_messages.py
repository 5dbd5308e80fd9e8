"""The first messages wait until enough is known to map them."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

_PATIENCE = 2_000_000_000
"""Nanoseconds for which the first scan waits."""
_MOST_WAITING = 4096
"""Messages: odometry may come for hours before the laser is switched on."""
_COMPARED = 400
"""Messages, some two seconds of scans and odometry: what is compared anew with each that comes."""

Arrived: TypeAlias = tuple[bool, Any, int]
"""Is it a scan (or else odometry); the message; nanoseconds when it came."""


class FirstMessages:
    """Waits to learn where the laser sits, for odometry, and how both are meant.

    A mapper learns from its first scan where the laser sits; and where a drive was broken off, only wheels
    show how far the car went meanwhile, so what it saw before they did would be placed as if it had stood.
    """

    def __init__(
        self, knows_place: Callable[[Any], bool], understands: Callable[[Sequence[Arrived]], bool]
    ) -> None:
        """``knows_place``: whether it is known where the laser of a scan's message sits; ``understands``:
        whether it is no longer in doubt how the messages are meant."""
        self._knows_place, self._understands = knows_place, understands
        self._waiting: deque[Arrived] = deque(maxlen=_MOST_WAITING)
        self.are_taken = False
        """Whether nothing waits any longer."""

    def add(self, is_scan: bool, message: Any, arrival: int) -> list[Arrived]:
        """Take a message; those that are to be mapped now. Scans from before the first odometry never are,
        unless none comes."""
        if self.are_taken:
            return [(is_scan, message, arrival)]
        self._waiting.append((is_scan, message, arrival))
        first_scan = next((each for each in self._waiting if each[0]), None)
        if first_scan is None:
            return []
        first_odometry = next((at for at, each in enumerate(self._waiting) if not each[0]), None)
        is_late = arrival - first_scan[2] > _PATIENCE
        if not is_late and (first_odometry is None or not self._knows_place(first_scan[1])):
            return []
        if not self._understands(list(self._waiting)[-_COMPARED:]) and not is_late:
            return []
        self.are_taken = True
        waiting = list(self._waiting)[first_odometry or 0 :]
        self._waiting.clear()
        return waiting
