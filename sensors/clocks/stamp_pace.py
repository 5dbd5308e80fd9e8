"""The pace of stamps relative to the arrivals of their messages: above real time if a bag is played faster.

Messages may be delayed or lost, but never come early. So among those that arrived in some period, the one
delayed least shows the true time.
"""

from collections import deque

_STEP = 50_000_000
"""Nanoseconds of arrivals between stored messages, so that a burst of delayed ones counts little. Chosen by
judgement."""
_STEPS, _FEWEST = 20, 4
"""Number of messages kept, at least one of which in each half must be undelayed, and the minimum for an
estimate of the pace. Chosen by judgement: setting a clock sooner goes unnoticed."""
_FASTEST_CLOCK = 1.2
"""Multiple of real time. Chosen by judgement: no clock is a fifth too fast, few play bags that slowly."""
_FASTEST_PLAY = 100.0
"""Initial bound on a bag's playback speed, as a multiple of real time. Chosen by judgement."""


class StampPace:
    """Follows the messages of one topic."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=_STEPS)
        self.real_time_factor = _FASTEST_PLAY
        """How many times faster than real time the stamps may run; 1 if they run like a clock."""

    def follow(self, stamp: int, arrival: int) -> None:
        """Add the next message, with its stamp and its arrival in nanoseconds."""
        if self._seen and arrival - self._seen[-1][1] < _STEP:
            return
        self._seen.append((stamp, arrival))
        if len(self._seen) >= _FEWEST:
            factor = self._measured()
            self.real_time_factor = factor if factor > _FASTEST_CLOCK else 1.0

    def ahead(self, stamp: int, arrival: int) -> int:
        """Nanoseconds by which a stamp is ahead of that of an undelayed message."""
        factor = self.real_time_factor
        return min(stamp - before - round(factor * (arrival - then)) for before, then in self._seen)

    def _measured(self) -> float:
        half = len(self._seen) // 2
        ahead = [stamp - arrival for stamp, arrival in self._seen]
        gained = max(ahead[half:]) - max(ahead[:half])
        return 1.0 + gained / (self._seen[half][1] - self._seen[0][1])
