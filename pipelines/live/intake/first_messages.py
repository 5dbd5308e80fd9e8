"""Hold back the first messages until enough is known to map them."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

_PATIENCE = 2_000_000_000
"""Nanoseconds for which the first scan waits."""
_MOST_WAITING = 4096
"""Messages: odometry may arrive for hours before the laser is switched on."""
_COMPARED = 400
"""Messages, some two seconds of scans and odometry, which are compared again with each new one."""

Arrived: TypeAlias = tuple[bool, Any, int]
"""Whether it is a scan (or else odometry), the message, and its arrival time in nanoseconds."""


class FirstMessages:
    """Waits for the laser's place, for odometry, and for how to interpret both.

    A mapper learns the laser's place from its first scan. Where a drive was interrupted, only the wheels show
    how far the car went meanwhile, so earlier scans would be placed as if it had stood still.
    """

    def __init__(
        self, knows_place: Callable[[Any], bool], understands: Callable[[Sequence[Arrived]], bool]
    ) -> None:
        """``knows_place``: whether the place of the laser of a scan message is known; ``understands``:
        whether the interpretation of the messages is certain."""
        self._knows_place, self._understands = knows_place, understands
        self._waiting: deque[Arrived] = deque(maxlen=_MOST_WAITING)
        self.are_taken = False
        """Whether the wait is over."""

    def add(self, is_scan: bool, message: Any, arrival: int) -> list[Arrived]:
        """Add a message; returns those to be mapped now. Scans from before the first odometry are dropped,
        unless none arrives."""
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
