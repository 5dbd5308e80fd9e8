"""The offset between the clocks of a sensor and of the laser, from the arrival times of their messages."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from statistics import median

_LARGEST_DELAY = 500_000_000
"""Maximum nanoseconds by which one sensor's messages may arrive later than another's; more is a clock offset.
Chosen by judgement: data half a second old is useless for driving, and smaller lags are learned from
turns."""
_STEADY = 0.5
"""Share of the offset by which it may vary: delays come and go, while clocks that disagree always do. Chosen
by judgement."""
_WATCHED, _FEWEST = 800_000_000, 5
"""Nanoseconds of arrivals, and comparisons, over which the offset must have been steady. Chosen by judgement:
it adds to the two seconds within which a localizer should be right again."""
_OTHER_TIME = 60_000_000_000
"""Nanoseconds above which an offset is accepted once seen twice. No message takes a minute, so this is
another time base, such as that of a simulator or the time since power-on."""

_REMEMBERED = 1000
"""Messages of the sensor kept for scans that are still to come. Chosen by judgement: 5 s of a fast one."""


class ClockOffset:
    """Collects how far the stamps of scans are ahead of those of another sensor."""

    def __init__(self) -> None:
        self._own: deque[tuple[int, int]] = deque(maxlen=_REMEMBERED)
        self._samples: deque[tuple[int, int]] = deque()

    @property
    def is_small(self) -> bool:
        """Whether the clocks seem to agree, by the latest comparison."""
        return bool(self._samples) and abs(self._samples[-1][1]) < _LARGEST_DELAY

    def from_scans(self, arrival: int, offset: int, scans: Sequence[tuple[int, int]], pace: float) -> int:
        """Nanoseconds to add to this sensor's stamps; 0 as long as they may be right.

        ``offset`` is the stamp minus the arrival of the current message; ``scans`` are arrivals and the same
        offsets of the scans since the last message; stamps run at ``pace`` times real time. Offsets are
        compared at the arrival of each scan, because all of them drift when a bag is played at another speed;
        a scan may have been processed late, after many messages of this sensor.
        """
        if self._own and arrival <= self._own[-1][0]:
            return 0
        self._own.append((arrival, offset))
        for scan_arrival, scan_offset in scans:
            own_offset = self._own_offset_at(scan_arrival)
            if own_offset is not None:
                self._samples.append((scan_arrival, scan_offset - own_offset))
        missing = self._settled(pace)
        if missing:
            self._samples.clear()
            self._own.clear()
            self._own.append((arrival, offset + missing))
        return missing

    def _own_offset_at(self, arrival: int) -> int | None:
        """Interpolated between the messages before and after it; None if it is older than those kept."""
        after = bisect_left(self._own, (arrival, 0))
        if not 0 < after < len(self._own):
            return None
        (first, begin), (last, end) = self._own[after - 1], self._own[after]
        return begin + round((arrival - first) / (last - first) * (end - begin))

    def _settled(self, pace: float) -> int:
        samples = self._samples
        if len(samples) < 2:
            return 0
        before, latest = samples[-2], samples[-1]
        if abs(latest[1]) > pace * _OTHER_TIME and abs(latest[1] - before[1]) < _LARGEST_DELAY:
            return latest[1]
        while len(samples) > _FEWEST and samples[1][0] <= latest[0] - _WATCHED:
            samples.popleft()
        if len(samples) < _FEWEST or latest[0] - samples[0][0] < _WATCHED:
            return 0
        offsets = [each for _, each in samples]
        if min(abs(each) for each in offsets) < _LARGEST_DELAY:
            return 0
        middle = round(median(offsets))
        return middle if max(offsets) - min(offsets) < _STEADY * abs(middle) else 0
