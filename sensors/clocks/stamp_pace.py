"""How fast stamps go beside the arrivals of their messages: faster than time where a bag is played so.

Messages may wait, and get lost, but never come too early: so of those that came in some time, the one that
waited least shows what the time was.
"""

from collections import deque

_STEP = 50_000_000
"""Nanoseconds of arrivals after which the next message is remembered: by judgement, so that what waited and
comes at once counts little."""
_STEPS, _FEWEST = 20, 4
"""Messages that are remembered, of which one in each half must not have waited, and from which on they tell
the pace. By judgement, as a clock that is set sooner is not noticed."""
_FASTEST_CLOCK = 1.2
"""Times as fast as time: no clock is a fifth too fast, and few play bags as slowly as that. By judgement."""
_FASTEST_PLAY = 100.0
"""Times as fast as time that a bag may be played, for all that is known at first: by judgement."""


class StampPace:
    """Follows the messages of one topic."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=_STEPS)
        self.real_time_factor = _FASTEST_PLAY
        """How many times as fast as time the stamps may go; 1 where they go as a clock does."""

    def follow(self, stamp: int, arrival: int) -> None:
        """Take in the next message, by the nanoseconds of its stamp and of its arrival."""
        if self._seen and arrival - self._seen[-1][1] < _STEP:
            return
        self._seen.append((stamp, arrival))
        if len(self._seen) >= _FEWEST:
            factor = self._measured()
            self.real_time_factor = factor if factor > _FASTEST_CLOCK else 1.0

    def ahead(self, stamp: int, arrival: int) -> int:
        """Nanoseconds by which a stamp is later than that of a message which did not wait would be."""
        factor = self.real_time_factor
        return min(stamp - before - round(factor * (arrival - then)) for before, then in self._seen)

    def _measured(self) -> float:
        half = len(self._seen) // 2
        ahead = [stamp - arrival for stamp, arrival in self._seen]
        gained = max(ahead[half:]) - max(ahead[:half])
        return 1.0 + gained / (self._seen[half][1] - self._seen[0][1])
