"""One timeline for all sensors, even if a clock is set during a drive.

Header stamps jump when a clock is set, for instance over the network after start-up. They stand still when a
driver hangs, and each sensor may have its own clock. The times of arrival or recording keep running all the
same. The algorithms see steady stamps; what is published live carries the stamps of the headers.
"""

from collections import deque
from dataclasses import dataclass
from threading import Lock

from racecar.sensors.clocks.clock_offset import ClockOffset
from racecar.sensors.clocks.stamp_pace import StampPace

_AHEAD = 2_000_000_000
"""Nanoseconds by which a stamp may be ahead of its expected arrival. Chosen by judgement. One that is behind
may just have been delayed."""
_BACK = 1_000_000_000
"""Nanoseconds by which stamps may go back, because messages overtook each other."""
_PAUSE = 1_000_000_000
"""Nanoseconds of pause assumed in a drive when the clock no longer shows it. Chosen by judgement."""
SAME_JUMP = _BACK
"""Nanoseconds within which two topics' jumps are one. Smaller jumps are not detected, and on a busy machine
messages may wait for most of a second. Two jumps would separate scans from their odometry."""
_STILL_AFTER, _STILL_MESSAGES = 300_000_000, 3
"""Nanoseconds, and messages, of a repeated stamp after which it counts as standing still: duplicates repeat
for less. Chosen by judgement: it adds to the two seconds within which a localizer should be right again."""
_MOVES_AGAIN = 3
"""Consecutive messages with moving stamps after which they are trusted again: stamps of whole seconds never
yield two, because sensors that send once a second or less are rare."""
_SLOWEST = 0.01
"""Share of the arrivals' pace below which stamps do not show time, since no bag is played that slowly; some
drivers put a message counter in them."""
_USUAL_OF = 60
"""Messages whose shortest delay is the usual one: enough for some to be undelayed, and few compared with a
drive, since delays seem to grow when a bag is played slowly. Chosen by judgement."""


class ClockReports:
    """Receives reports on problems with a topic's stamps; this one ignores them."""

    def jumped(self, seconds: float) -> None:
        """The headers' clock was set by this much; the steady stamps continue."""

    def went_astray(self) -> None:
        """The stamp of one message was far from the previous ones; it is dropped."""

    def stood_still(self, is_still: bool) -> None:
        """Whether arrivals replace the headers, which do not show time."""

    def disagreed(self, seconds: float) -> None:
        """The stamps were this far behind those of the scans, and are corrected now."""


class SteadyClock:
    """The state shared by the topics' clocks; may be read from several threads."""

    def __init__(self, offset: int = 0) -> None:
        """``offset``: steady time minus arrival time, used until a header shows it."""
        self.after: int | None = None
        """The last steady stamp of a resumed drive, in nanoseconds."""
        self.jumps: list[float] = []
        """Seconds by which clocks were set; those of several topics at once are one."""
        self._lock = Lock()
        self._shifts = [0]
        self._offset = offset
        self._references: deque[tuple[int, int]] = deque(maxlen=256)
        self._references_seen = 0

    def nearest_shift(self, shift: int) -> int:
        """The matching shift of another topic, so that both agree to the nanosecond, or else this one."""
        with self._lock:
            nearest = min(self._shifts, key=lambda known: abs(known - shift))
            if abs(nearest - shift) < SAME_JUMP:
                return nearest
            self._shifts = [*self._shifts[-9:], shift]
            return shift

    def note_jump(self, seconds: float) -> None:
        """Note the seconds by which a topic's clock was set."""
        with self._lock:
            if all(abs(seconds - known) * 1e9 >= SAME_JUMP for known in self.jumps):
                self.jumps = [*self.jumps[-9:], seconds]

    def first_shift(self, header: int, arrival: int) -> int:
        """The initial shift: that of the other topics, if this header's clock was set with theirs. It also
        keeps the time of a resumed drive from going back."""
        with self._lock:
            wanted = header - self.without_stamp(arrival)
            nearest = min(self._shifts, key=lambda known: abs(known - wanted))
            if abs(nearest - wanted) < SAME_JUMP:
                return nearest
        if self.after is None or header > self.after:
            return 0
        return self.nearest_shift(header - self.after - _PAUSE)

    def note(self, offset: int) -> None:
        """Store the steady time minus the arrival time, for topics without stamps of their own."""
        self._offset = offset

    def without_stamp(self, arrival: int) -> int:
        """The steady time of a message without a stamp."""
        return arrival + self._offset

    def note_reference(self, arrival: int, offset: int) -> None:
        """The same for a scan; the clocks of the other topics are compared with it."""
        with self._lock:
            self._references.append((arrival, offset))
            self._references_seen += 1

    def references(self, since: int, until: int) -> tuple[list[tuple[int, int]], int]:
        """Arrivals and offsets of the scans from number ``since`` on that arrived by ``until``, and the
        number of the scan after them."""
        with self._lock:
            count = min(self._references_seen - since, len(self._references))
            recent = [self._references[k] for k in range(-count, 0)]
            found = [each for each in recent if each[0] <= until]
            return found, self._references_seen - (len(recent) - len(found))


class TopicClock:
    """Steady stamps of one sensor's messages."""

    def __init__(
        self, shared: SteadyClock, reports: ClockReports, *, is_reference: bool = False, decided_by: int = 2
    ) -> None:
        """``is_reference``: its stamps are those of the scans, to which the others are matched;
        ``decided_by``: consecutive messages that show that a clock was set."""
        self._shared = shared
        self._reports = reports
        self._offset = None if is_reference else ClockOffset()
        self._decided_by = decided_by
        self._references_taken = 0
        self._shift = self._correction = 0
        self._last: _Seen | None = None
        self._suspected: list[_Seen] = []
        self._before: _Seen | None = None
        self._moved_at = 0
        self._repeats = self._moves = 0
        self.is_still = False
        """Whether arrivals replace the headers, which do not show time."""
        self._usual: deque[int] = deque(maxlen=_USUAL_OF)
        self._pace = StampPace()

    @property
    def correction(self) -> int:
        """Nanoseconds added to the stamps to make them agree with those of the scans."""
        return self._correction

    @property
    def behind(self) -> int:
        """Nanoseconds by which the headers are behind the steady time, as far as detected."""
        return self._correction - self._shift

    @property
    def agrees(self) -> bool:
        """Whether the stamps seem to agree with those of the scans."""
        return self._offset is None or self._offset.is_small

    def correct(self, correction: int) -> None:
        """Add nanoseconds to the stamps from now on: their measured delay behind those of the scans."""
        self._correction += correction
        self._usual = deque((each + correction for each in self._usual), maxlen=_USUAL_OF)
        self._reports.disagreed(correction * 1e-9)

    def steady(self, header: int, arrival: int, sweep: int = 0) -> int | None:
        """The steady stamp of a message, from the times of its header and arrival in nanoseconds.

        ``sweep``: nanoseconds from the stamp to the last reading in the message. None for a message whose
        stamp is far from the previous ones: it has to be dropped, as it may be an outlier.
        """
        self.follow(header, arrival)
        if self._suspected:
            return None
        steady = self.stamp(header, arrival, sweep)
        self._compare(arrival, steady + sweep - arrival)
        return steady

    def follow(self, header: int, arrival: int) -> int:
        """Add the next message; returns how many of the latest are in doubt, so that later messages may
        change the result of `stamp` for them."""
        seen = _Seen(header, arrival)
        is_repeated = self._before is not None and header == self._before.header
        if not self._shows_time(seen):
            self._suspected = []
            return 0
        if not self._is_believed(seen):
            return len(self._suspected)
        if not self._repeats:
            self._usual.append(header - self._shift + self._correction - arrival)
        return self._repeats if is_repeated else 0

    def stamp(self, header: int, arrival: int, sweep: int = 0) -> int:
        """The steady stamp of a message, as far as the clock is known now."""
        if self.is_still:
            return self.by_arrival(arrival, sweep)
        return header - self._shift + self._correction

    def by_arrival(self, arrival: int, sweep: int = 0) -> int:
        """The arrival minus the usual delay; if no stamps are known, the last reading is from the arrival."""
        if self._usual:
            return arrival + max(self._usual)
        return self._shared.without_stamp(arrival) - sweep

    def _shows_time(self, seen: "_Seen") -> bool:
        """Whether the headers advance with time."""
        before, self._before = self._before, seen
        if seen.header <= 0:
            self._moves = 0
            self._set_still(True)
        elif before is None or abs(seen.header - before.header) > _SLOWEST * (seen.arrival - before.arrival):
            self._moved_at, self._repeats, self._moves = seen.arrival, 0, self._moves + 1
        else:
            self._repeats, self._moves = self._repeats + 1, 0
            if self._repeats >= _STILL_MESSAGES and seen.arrival - self._moved_at > _STILL_AFTER:
                self._set_still(True)
        if self.is_still and self._moves >= _MOVES_AGAIN:
            self._go_on_from_arrivals(seen)
            self._set_still(False)
        return not self.is_still

    def _set_still(self, is_still: bool) -> None:
        if is_still != self.is_still:
            self.is_still = is_still
            self._reports.stood_still(is_still)

    def _go_on_from_arrivals(self, seen: "_Seen") -> None:
        """Use the headers again, at the time they should show by now or at the time they do show."""
        expected = self.by_arrival(seen.arrival)
        shift = self._shift
        if self._last is None or abs(seen.header + self._correction - shift - expected) >= SAME_JUMP:
            shift = self._shared.nearest_shift(seen.header + self._correction - expected)
        if shift != self._shift and self._last is not None:
            self._note_jump(shift - self._shift)
        self._shift, self._last, self._suspected = shift, seen, []

    def _is_believed(self, seen: "_Seen") -> bool:
        suspected, self._suspected = self._suspected, []
        if suspected and not seen.follows(suspected[-1], self._pace.real_time_factor):
            self._reports.went_astray()
            suspected = []
        if self._last is None:
            self._shift = self._shared.first_shift(seen.header, seen.arrival)
        elif not self._goes_on(seen, self._last):
            suspected.append(seen)
            if len(suspected) < self._decided_by:
                self._suspected = suspected
                return False
            self._follow_jump(suspected[0], self._last)
        self._last = seen
        self._pace.follow(seen.header - self._shift, seen.arrival)
        return True

    def _goes_on(self, seen: "_Seen", last: "_Seen") -> bool:
        """Whether no clock was set, even if messages in between were lost and the last one was delayed."""
        return seen.follows(last) or (seen.header > last.header - _BACK and self._ahead(seen) < _AHEAD)

    def _ahead(self, seen: "_Seen") -> int:
        return self._pace.ahead(seen.header - self._shift, seen.arrival)

    def _follow_jump(self, suspected: "_Seen", last: "_Seen") -> None:
        """Treat it as a clock that was set, unless a bag may be played fast: then it is a pause in the
        recording, or messages were lost."""
        jump = suspected.jump_from(last)
        if jump > 0:
            if self._pace.real_time_factor > 1.0:
                return
            jump = self._ahead(suspected)
        self._shift = self._shared.nearest_shift(self._shift + jump)
        self._note_jump(jump)

    def _note_jump(self, jump: int) -> None:
        self._shared.note_jump(jump * 1e-9)
        self._reports.jumped(jump * 1e-9)

    def _compare(self, arrival: int, offset: int) -> None:
        """Compare with the scans, using their last readings, as they are sent when they are complete."""
        self._shared.note(offset)
        if self._offset is None:
            self._shared.note_reference(arrival, offset)
            return
        scans, self._references_taken = self._shared.references(self._references_taken, arrival)
        missing = self._offset.from_scans(arrival, offset, scans, self._pace.real_time_factor)
        if missing:
            self.correct(missing)


@dataclass(frozen=True)
class _Seen:
    """A stamp and the arrival time of its message; nanoseconds."""

    header: int
    arrival: int

    def follows(self, before: "_Seen", pace: float = 1.0) -> bool:
        """Whether no clock was set in between, if stamps run at ``pace`` times real time."""
        return -_BACK < self.header - before.header < pace * max(self.arrival - before.arrival, 0) + _AHEAD

    def jump_from(self, before: "_Seen") -> int:
        """Nanoseconds by which the headers' clock was set."""
        return self.header - before.header - (self.arrival - before.arrival)
