"""One time line for all topics, also when somebody sets a clock while the car drives.

The headers of messages jump when a clock is set, for instance by the network after start-up. The
algorithms see stamps that go on steadily; what is published bears the stamps of the headers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

_AHEAD = 2_000_000_000
"""Nanoseconds by which a stamp may be ahead of what the arrivals say; what is behind may just have waited."""
_BACK = 1_000_000_000
"""Nanoseconds by which stamps may go back, because messages overtook each other."""
_PAUSE = 1_000_000_000
"""Nanoseconds that a drive is taken to have paused when the clock no longer shows it."""
_SAME = _BACK
"""Nanoseconds within which two topics' jumps are one and the same: smaller jumps are not seen, and on a busy
machine messages may wait for most of a second. Taken for two, they would part scans from their odometry."""


class SteadyClock:
    """What the topics' clocks have in common; they may be read in several threads."""

    def __init__(self, after: int | None = None) -> None:
        """``after``: the last steady stamp of a drive that is carried on, in nanoseconds."""
        self._after = after
        self._lock = Lock()
        self._shifts = [0]
        self._offset = 0

    def nearest_shift(self, shift: int) -> int:
        """A shift that another topic has found, so that both agree to the nanosecond, or else this one."""
        with self._lock:
            nearest = min(self._shifts, key=lambda known: abs(known - shift))
            if abs(nearest - shift) < _SAME:
                return nearest
            self._shifts = [*self._shifts[-9:], shift]
            return shift

    def first_shift(self, header: int) -> int:
        """The shift to begin with, so that a drive that is carried on does not go back in time."""
        if self._after is None or header > self._after:
            return 0
        return self.nearest_shift(header - self._after - _PAUSE)

    def note(self, steady: int, arrival: int) -> None:
        """Remember how the steady time runs, for topics without stamps of their own."""
        self._offset = steady - arrival

    def without_stamp(self, arrival: int) -> int:
        """The steady time of a message that bears no stamp."""
        return arrival + self._offset


class TopicClock:
    """Steady stamps of one topic's messages."""

    def __init__(self, shared: SteadyClock, report_jump: Callable[[float], None]) -> None:
        """``report_jump`` gets the seconds by which the headers have jumped."""
        self._shared = shared
        self._report_jump = report_jump
        self._shift = 0
        self._last: _Seen | None = None
        self._suspected: _Seen | None = None

    def steady(self, header: int, arrival: int) -> int | None:
        """The steady stamp of a message, from its header's and its arrival's time in nanoseconds.

        None for a lone message whose stamp is far from those before: it is to be left out.
        """
        if header <= 0:
            return self._shared.without_stamp(arrival)
        seen = _Seen(header, arrival)
        if self._last is None:
            self._shift = self._shared.first_shift(header)
        if self._last is not None and not seen.follows(self._last):
            if self._suspected is None or not seen.follows(self._suspected):
                self._suspected = seen
                return None
            jump = self._suspected.jump_from(self._last)
            self._shift = self._shared.nearest_shift(self._shift + jump)
            self._report_jump(jump * 1e-9)
        self._last, self._suspected = seen, None
        steady = header - self._shift
        self._shared.note(steady, arrival)
        return steady


@dataclass(frozen=True)
class _Seen:
    """A stamp, and when the message that bore it arrived; nanoseconds."""

    header: int
    arrival: int

    def follows(self, before: "_Seen") -> bool:
        """Whether no clock was set in between."""
        return -_BACK < self.header - before.header < max(self.arrival - before.arrival, 0) + _AHEAD

    def jump_from(self, before: "_Seen") -> int:
        """By how much the headers' clock was set."""
        return self.header - before.header - (self.arrival - before.arrival)
