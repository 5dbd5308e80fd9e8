"""One time line for all sensors, also when somebody sets a clock while the car drives.

The headers of messages jump when a clock is set, for instance by the network after start-up; they stand still
when a driver hangs; and each sensor may have a clock of its own. Messages arrive, or are recorded, in time
all the same. The algorithms see stamps that go on steadily; what is published live bears the stamps of the
headers.
"""

from collections import deque
from dataclasses import dataclass
from threading import Lock

from racecar.sensors.clocks.clock_offset import ClockOffset
from racecar.sensors.clocks.stamp_pace import StampPace

_AHEAD = 2_000_000_000
"""Nanoseconds by which a stamp may be ahead of what the arrivals say. Chosen by judgement; what is behind may
just have waited."""
_BACK = 1_000_000_000
"""Nanoseconds by which stamps may go back, because messages overtook each other."""
_PAUSE = 1_000_000_000
"""Nanoseconds that a drive is taken to have paused when the clock no longer shows it. Chosen by judgement."""
_SAME = _BACK
"""Nanoseconds within which two topics' jumps are one and the same: smaller jumps are not seen, and on a busy
machine messages may wait for most of a second. Taken for two, they would part scans from their odometry."""
_STILL_AFTER, _STILL_MESSAGES = 300_000_000, 3
"""Nanoseconds for which, and messages in which, a stamp must be repeated until it counts as standing still:
what is sent twice is repeated for less. By judgement, as it comes off the two seconds within which a
localizer should be right again."""
_MOVES_AGAIN = 3
"""Messages in a row with stamps that move, after which they are believed again: with stamps of whole seconds
there are never two, because sensors that send once a second or less are rare."""
_SLOWEST = 0.01
"""Of the pace of the arrivals: stamps that move on by less do not show time, since no bag is played that
slowly; some drivers count messages in them."""
_USUAL_OF = 60
"""Messages, of whose delays the shortest is usual: so many that some of them did not wait, and few beside
those of a drive, as delays seem to grow where a bag is played slowly. By judgement."""


class ClockReports:
    """Is told what is wrong with the stamps of a topic; this one keeps it to itself."""

    def jumped(self, seconds: float) -> None:
        """The headers were set by so much; the steady stamps go on."""

    def went_astray(self) -> None:
        """The stamp of one message was far from those before; it is left out."""

    def stood_still(self, is_still: bool) -> None:
        """Whether the arrivals count instead, since the headers show no time."""

    def disagreed(self, seconds: float) -> None:
        """By so much the stamps were behind those of the scans, and are corrected now."""


class SteadyClock:
    """What the topics' clocks have in common; they may be read in several threads."""

    def __init__(self, offset: int = 0) -> None:
        """``offset``: by how much the time is ahead of that of the arrivals as long as no header shows it."""
        self.after: int | None = None
        """The last steady stamp of a drive that is carried on, in nanoseconds."""
        self._lock = Lock()
        self._shifts = [0]
        self._offset = offset
        self._references: deque[tuple[int, int]] = deque(maxlen=256)
        self._references_seen = 0

    def nearest_shift(self, shift: int) -> int:
        """A shift that another topic has found, so that both agree to the nanosecond, or else this one."""
        with self._lock:
            nearest = min(self._shifts, key=lambda known: abs(known - shift))
            if abs(nearest - shift) < _SAME:
                return nearest
            self._shifts = [*self._shifts[-9:], shift]
            return shift

    def first_shift(self, header: int, arrival: int) -> int:
        """The shift to begin with: the one that others have by now, where this header was set with theirs;
        and so that a drive that is carried on does not go back in time."""
        with self._lock:
            wanted = header - self.without_stamp(arrival)
            nearest = min(self._shifts, key=lambda known: abs(known - wanted))
            if abs(nearest - wanted) < _SAME:
                return nearest
        if self.after is None or header > self.after:
            return 0
        return self.nearest_shift(header - self.after - _PAUSE)

    def note(self, offset: int) -> None:
        """Remember by how much the steady time is ahead of the arrivals, for topics without stamps of their
        own."""
        self._offset = offset

    def without_stamp(self, arrival: int) -> int:
        """The steady time of a message that bears no stamp."""
        return arrival + self._offset

    def note_reference(self, arrival: int, offset: int) -> None:
        """The same of a scan, with whose clock those of the other topics are compared."""
        with self._lock:
            self._references.append((arrival, offset))
            self._references_seen += 1

    def references(self, since: int, until: int) -> tuple[list[tuple[int, int]], int]:
        """Arrivals and offsets of the scans from number ``since`` on that came up to an arrival, and the
        number of the one after them."""
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
        """``is_reference``: its stamps are those of the scans, with which others are made to agree;
        ``decided_by`` so many messages in a row it is that a clock was set."""
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
        """Whether the arrivals count, as the headers show no time."""
        self._usual: deque[int] = deque(maxlen=_USUAL_OF)
        self._pace = StampPace()

    @property
    def correction(self) -> int:
        """Nanoseconds that were added to the stamps, so that they agree with those of the scans."""
        return self._correction

    @property
    def behind(self) -> int:
        """Nanoseconds by which the headers are behind the steady time, as far as was noticed."""
        return self._correction - self._shift

    @property
    def agrees(self) -> bool:
        """Whether the stamps seem to agree with those of the scans."""
        return self._offset is None or self._offset.is_small

    def correct(self, correction: int) -> None:
        """Add so many nanoseconds to the stamps from now on, as they were found to be behind the scans'."""
        self._correction += correction
        self._usual = deque((each + correction for each in self._usual), maxlen=_USUAL_OF)
        self._reports.disagreed(correction * 1e-9)

    def steady(self, header: int, arrival: int, sweep: int = 0) -> int | None:
        """The steady stamp of a message, from its header's and its arrival's time in nanoseconds.

        ``sweep``: nanoseconds from the moment that the stamp means to the last reading in the message.
        None for a message whose stamp is far from those before: it is to be left out, as it may be alone.
        """
        self.follow(header, arrival)
        if self._suspected:
            return None
        steady = self.stamp(header, arrival, sweep)
        self._compare(arrival, steady + sweep - arrival)
        return steady

    def follow(self, header: int, arrival: int) -> int:
        """Take in the next message; how many of the latest are in doubt, so that those after them may change
        what `stamp` says of them."""
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
        """The steady stamp of a message, by what is known of the clock now."""
        if self.is_still:
            return self.by_arrival(arrival, sweep)
        return header - self._shift + self._correction

    def by_arrival(self, arrival: int, sweep: int = 0) -> int:
        """As long after its stamp as usual; a sensor that never bore stamps says its last reading at once."""
        if self._usual:
            return arrival + max(self._usual)
        return self._shared.without_stamp(arrival) - sweep

    def _shows_time(self, seen: "_Seen") -> bool:
        """Whether the headers move on with time."""
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
        """The headers count again, where they would have been by now or from where they are."""
        expected = self.by_arrival(seen.arrival)
        shift = self._shift
        if self._last is None or abs(seen.header + self._correction - shift - expected) >= _SAME:
            shift = self._shared.nearest_shift(seen.header + self._correction - expected)
        if shift != self._shift and self._last is not None:
            self._reports.jumped((shift - self._shift) * 1e-9)
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
        """Whether no clock was set, though messages in between were lost and the last one had waited."""
        return seen.follows(last) or (seen.header > last.header - _BACK and self._ahead(seen) < _AHEAD)

    def _ahead(self, seen: "_Seen") -> int:
        return self._pace.ahead(seen.header - self._shift, seen.arrival)

    def _follow_jump(self, suspected: "_Seen", last: "_Seen") -> None:
        """A clock was set, unless a bag may be played fast: then it is a pause in the recording, or messages
        were lost."""
        jump = suspected.jump_from(last)
        if jump > 0:
            if self._pace.real_time_factor > 1.0:
                return
            jump = self._ahead(suspected)
        self._shift = self._shared.nearest_shift(self._shift + jump)
        self._reports.jumped(jump * 1e-9)

    def _compare(self, arrival: int, offset: int) -> None:
        """With the scans, of which the last readings count, as they are sent when they are complete."""
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
    """A stamp, and when the message that bore it arrived; nanoseconds."""

    header: int
    arrival: int

    def follows(self, before: "_Seen", pace: float = 1.0) -> bool:
        """Whether no clock was set in between, of those that go so many times as fast as time."""
        return -_BACK < self.header - before.header < pace * max(self.arrival - before.arrival, 0) + _AHEAD

    def jump_from(self, before: "_Seen") -> int:
        """By how much the headers' clock was set."""
        return self.header - before.header - (self.arrival - before.arrival)
