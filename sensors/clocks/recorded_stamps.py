"""The stamps of recorded messages, even where drivers leave them empty: a clock that looks ahead."""

from collections import Counter, deque
from collections.abc import Iterator
from typing import Generic, TypeVar

from racecar.sensors.clocks.topic_clock import ClockReports, SteadyClock, TopicClock

T = TypeVar("T")

_LARGEST_JUMP = 3_600_000_000_000
"""Nanoseconds from the recorder's clock above which a header is invalid. Chosen by judgement."""
_DECIDED_BY = 3
"""Consecutive messages that show that a clock was set; late or damaged ones come in shorter runs. Chosen by
judgement."""


class RecordedStamps(Generic[T]):
    """The stamp of each message of a topic: its header's, or else the time it was recorded.

    A recording can be read ahead, so doubtful messages wait until later ones show what is wrong.
    """

    def __init__(self, shared: SteadyClock, counts: Counter[str], *, trusts_headers: bool = True) -> None:
        """``shared`` is common to the recording's topics; ``counts`` collects what was corrected."""
        self._clock = TopicClock(shared, _Counted(counts), decided_by=_DECIDED_BY)
        self._counts, self._trusts_headers = counts, trusts_headers
        self._waiting: deque[tuple[T, int, int]] = deque()

    def stamped(self, message: T, header: int, recorded: int) -> Iterator[tuple[T, int]]:
        """Add a message; yields those whose stamps (nanoseconds) are settled, this or earlier ones."""
        if header <= 0 or not self._trusts_headers:
            yield message, self._by_recorder(recorded)
            return
        in_doubt = self._clock.follow(header, recorded)
        while len(self._waiting) > max(in_doubt - 1, 0):
            yield self._settled(*self._waiting.popleft())
        if in_doubt:
            self._waiting.append((message, header, recorded))
        else:
            yield message, self._stamp(header, recorded)

    def rest(self) -> Iterator[tuple[T, int]]:
        """The messages that still wait, stamped by their headers."""
        while self._waiting:
            yield self._settled(*self._waiting.popleft())

    def _settled(self, message: T, header: int, recorded: int) -> tuple[T, int]:
        """A doubtful message; stamped with the recording time if its header is invalid."""
        stamp = self._stamp(header, recorded)
        if abs(stamp - self._clock.by_arrival(recorded)) >= _LARGEST_JUMP:
            return message, self._by_recorder(recorded)
        return message, stamp

    def _stamp(self, header: int, recorded: int) -> int:
        self._counts["stamps_that_stood_still"] += self._clock.is_still
        return self._clock.stamp(header, recorded)

    def _by_recorder(self, recorded: int) -> int:
        self._counts["stamps_from_recording_time"] += 1
        return self._clock.by_arrival(recorded)


class _Counted(ClockReports):
    """Counts the jumps that a clock finds."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts

    def jumped(self, seconds: float) -> None:
        self._counts["clock_jumps"] += 1
