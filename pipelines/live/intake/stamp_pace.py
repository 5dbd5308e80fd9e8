"""How fast stamps go beside the arrivals of their messages: faster than time where a bag is played so."""

from collections import deque
from statistics import median

_STEP = 50_000_000
"""Nanoseconds of arrivals over which a pace is measured: by judgement, as it outlasts most delays."""
_STEPS, _FEWEST = 20, 10
"""Of which the median counts, so that a clock that is set, or messages that waited, do not make it."""
_FASTEST_CLOCK = 1.2
"""Times as fast as time: no clock is a fifth too fast, and few play bags as slowly as that. By judgement."""


class StampPace:
    """Follows the messages of one topic."""

    def __init__(self) -> None:
        self._begun: tuple[int, int] | None = None
        self._steps: deque[float] = deque(maxlen=_STEPS)

    def follow(self, header: int, arrival: int) -> None:
        """Take in the next message, by the nanoseconds of its header and of its arrival."""
        if self._begun is None:
            self._begun = header, arrival
        elif arrival - self._begun[1] >= _STEP:
            self._steps.append((header - self._begun[0]) / (arrival - self._begun[1]))
            self._begun = header, arrival

    @property
    def is_played_fast(self) -> bool:
        """Whether the messages come from a bag that is played faster than it was recorded."""
        return len(self._steps) >= _FEWEST and median(self._steps) > _FASTEST_CLOCK
