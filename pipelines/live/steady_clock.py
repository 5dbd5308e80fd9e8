"""One time line for all topics, also when somebody sets a clock while the car drives.

The headers of messages jump when a clock is set, for instance by the network after start-up. The
algorithms see stamps that go on steadily; what is published bears the stamps of the headers.
"""

from collections.abc import Callable
from threading import Lock

_JUMP = 2_000_000_000
"""Nanoseconds by which header and arrival part at once when a clock was set."""
_SAME = 500_000_000
"""Nanoseconds within which two topics' jumps are one and the same."""


class SteadyClock:
    """What the topics' clocks have in common; they may be read in several threads."""

    def __init__(self) -> None:
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

    def note(self, steady: int, arrival: int) -> None:
        """Remember how the steady time runs, for topics without stamps of their own."""
        self._offset = steady - arrival

    def without_stamp(self, arrival: int) -> int:
        """The steady time of a message that bears no stamp."""
        return arrival + self._offset


class TopicClock:
    """Steady stamps of one topic's messages."""

    def __init__(self, shared: SteadyClock, tell_jump: Callable[[float], None]) -> None:
        """``tell_jump`` gets the seconds by which the headers have jumped."""
        self._shared = shared
        self._tell_jump = tell_jump
        self._shift = 0
        self._offset: int | None = None
        self._suspected: int | None = None

    def steady(self, header: int, arrival: int) -> int | None:
        """The steady stamp of a message, from its header's and its arrival's time in nanoseconds.

        None for a lone message whose stamp is far from those before: it is to be left out.
        """
        if header <= 0:
            return self._shared.without_stamp(arrival)
        offset = header - arrival
        if self._offset is not None and abs(offset - self._offset) >= _JUMP:
            if self._suspected is None or abs(offset - self._suspected) >= _JUMP:
                self._suspected = offset
                return None
            jump = offset - self._offset
            self._shift = self._shared.nearest_shift(self._shift + jump)
            self._tell_jump(jump * 1e-9)
        self._offset, self._suspected = offset, None
        steady = header - self._shift
        self._shared.note(steady, arrival)
        return steady
