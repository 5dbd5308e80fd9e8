"""Time stamps of messages, also where drivers leave them empty or let them jump."""

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

T = TypeVar("T")

_LARGEST_JUMP = 3_600_000_000_000
"""Nanoseconds between the header's clock and the recorder's; a header further off is absurd: by judgement."""
_BACK = 1_000_000_000
"""Nanoseconds by which stamps may go back: so far they are sorted."""
_AHEAD = 2_000_000_000
"""Nanoseconds by which they may be ahead of the recording, which may have waited before: by judgement."""
_DECIDED_BY = 3
"""Messages in a row by which it is decided that a clock was set or stands still; a few that were late or are
damaged are fewer. By judgement."""
_STILL_AFTER = 300_000_000
"""Nanoseconds for which a stamp is repeated until it stands still, since what is sent twice is repeated for
less."""
_REMEMBERED = 200
"""Messages after a pause of the recorder, which may all have waited, by judgement."""
_USUAL_OF = 9
"""Messages, of whose delays the median is taken, so that no single one that waited counts."""
_PACE = 0.25
"""Share by which clocks of one pace differ at most over a few messages, by judgement."""


def clock_offset(samples: Sequence[tuple[int, int]]) -> int | None:
    """Header time minus recording time, from pairs in nanoseconds; None where no header holds a time."""
    headers = {header for header, _ in samples}
    if not samples or (len(samples) > 1 and len(headers) == 1) or not any(headers):
        return None
    offsets = sorted(header - recorded for header, recorded in samples if header > 0)
    return offsets[len(offsets) // 2] if offsets else None


def keeps_pace(samples: Sequence[tuple[int, int]]) -> bool:
    """Whether headers and recording move on alike, so that one can stand in for the other; not so where a bag
    was recorded from one that was played faster, or where its recording times are none."""
    if len(samples) < 2:
        return False
    headers, recorded = np.median(np.diff(np.array(samples, dtype=np.float64), axis=0), axis=0)
    return bool(recorded > 0 and (headers == 0 or abs(headers / recorded - 1.0) < _PACE))


@dataclass(frozen=True)
class _Seen:
    header: int
    recorded: int

    def follows(self, before: "_Seen") -> bool:
        """Whether no clock was set in between."""
        recorded = max(self.recorded - before.recorded, 0)
        return -_BACK < self.header - before.header < recorded + _AHEAD


@dataclass(eq=False)
class ClockShifts:
    """By how much clocks were set during a recording; nanoseconds."""

    _known: list[int] = field(default_factory=lambda: [0])

    def nearest(self, shift: int) -> int:
        """A shift that another topic has found, so that both agree to the nanosecond, or else this one."""
        nearest = min(self._known, key=lambda known: abs(known - shift))
        if abs(nearest - shift) < _BACK:
            return nearest
        self._known = [*self._known[-9:], shift]
        return shift


class StampClock(Generic[T]):
    """The stamp of each message of a topic: its header's, or else the time it was recorded.

    Headers that stand still show no time. Where they jump, against the recording, a clock was set: the stamps
    go on as before. A message or two that jump alone were late or are damaged.
    """

    def __init__(
        self,
        offset: int,
        trust_headers: bool,
        counts: Counter[str],
        *,
        keeps_pace: bool = False,
        shifts: ClockShifts | None = None,
    ) -> None:
        """``offset`` in nanoseconds leads from the recorder's clock to that of the headers; where the two do
        not keep pace with each other, jumps are believed."""
        self._offset = offset
        self._trust_headers = trust_headers
        self._counts = counts
        self._keeps_pace = keeps_pace
        self._shifts = ClockShifts() if shifts is None else shifts
        self._shift = 0
        self._last: _Seen | None = None
        self._is_still, self._moves = False, 0
        self._offsets: deque[int] = deque(maxlen=_REMEMBERED)
        self._waiting: list[tuple[T, _Seen]] = []

    def stamped(self, message: T, header: int, recorded: int) -> Iterator[tuple[T, int]]:
        """Take the next message; those whose stamps (nanoseconds) are settled, this one or earlier ones."""
        seen = _Seen(header, recorded)
        if not self._keeps_pace or not self._trust_headers or header <= 0:
            yield message, self._stamp(seen)
            return
        if self._is_still:
            yield message, self._while_still(seen)
            return
        if self._last is None or self._goes_on(seen, self._last):
            yield from self.rest()
            self._last = seen
            yield message, self._stamp(seen)
            return
        if self._waiting and seen.header != self._last.header and not seen.follows(self._waiting[-1][1]):
            yield from self.rest()
        self._waiting.append((message, seen))
        yield from self._decided(self._last)

    def rest(self) -> Iterator[tuple[T, int]]:
        """The messages that wait, stamped as their headers say."""
        yield from self._settled(learns=False)

    def _settled(self, *, learns: bool) -> Iterator[tuple[T, int]]:
        waiting, self._waiting = self._waiting, []
        for message, seen in waiting:
            yield message, self._stamp(seen, learns=learns)

    def _goes_on(self, seen: _Seen, last: _Seen) -> bool:
        """Whether a header goes on from the last, or comes back to time after the recorder had waited."""
        if seen.header == last.header:
            return False
        if seen.follows(last) or seen.recorded <= last.recorded:
            return True
        return bool(self._offsets) and abs(self._of(seen) - max(self._offsets)) < _BACK

    def _decided(self, last: _Seen) -> Iterator[tuple[T, int]]:
        newest = self._waiting[-1][1]
        if all(seen.header == last.header for _, seen in self._waiting):
            if len(self._waiting) >= _DECIDED_BY and newest.recorded - last.recorded > _STILL_AFTER:
                self._is_still, self._moves = True, 0
                waiting, self._waiting = self._waiting, []
                for message, seen in waiting:
                    yield message, self._while_still(seen)
        elif len(self._waiting) >= _DECIDED_BY:
            self._set(newest)
            self._last = newest
            yield from self._settled(learns=True)

    def _while_still(self, seen: _Seen) -> int:
        last, self._last = self._last, seen
        self._moves = self._moves + 1 if last is not None and seen.header != last.header else 0
        if self._moves >= _DECIDED_BY:
            self._is_still = False
            if abs(self._of(seen) - self._offset) > _BACK:
                self._set(seen)
            return self._stamp(seen)
        self._counts["stamps_that_stood_still"] += 1
        return seen.recorded + self._offset

    def _set(self, seen: _Seen) -> None:
        """The clock was set: from here on it is so much ahead of what it was."""
        self._shift = self._shifts.nearest(self._shift + self._of(seen) - self._usual())
        self._counts["clock_jumps"] += 1

    def _usual(self) -> int:
        recent = sorted(list(self._offsets)[-_USUAL_OF:]) or [self._offset]
        return recent[len(recent) // 2]

    def _of(self, seen: _Seen) -> int:
        """By how much the stamp would be ahead of the recording, if its header is believed."""
        return seen.header - self._shift - seen.recorded

    def _stamp(self, seen: _Seen, *, learns: bool = True) -> int:
        offset = self._of(seen)
        if self._trust_headers and seen.header > 0 and abs(offset - self._offset) < _LARGEST_JUMP:
            if learns:
                self._offset = offset
                self._offsets.append(offset)
            return seen.header - self._shift
        self._counts["stamps_from_recording_time"] += 1
        return seen.recorded + self._offset


def typical_gap(stamps: Sequence[int]) -> float:
    """Seconds between neighbouring stamps, the median; inf where there are not two."""
    if len(stamps) < 2:
        return float("inf")
    return float(np.median(np.diff(np.sort(np.array(stamps, dtype=np.int64))))) * 1e-9
