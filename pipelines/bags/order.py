"""Scans and odometry in the order of their stamps."""

import heapq
from collections import Counter, deque
from collections.abc import Iterable, Iterator

from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan

Item = Scan | Odometry

_HORIZON = 1_000_000_000
"""Nanoseconds of log within which messages are sorted; drivers and recorders delay by less: by judgement."""
_MOST_WAITING = 10_000
"""Messages, so that memory does not grow where stamps stand still."""
_OVERTAKEN_FAR, _OVERTAKEN = 2000, 20
"""A message that so many later ones went before is astray, with a jump of the stamp after fewer: by
judgement."""
_JUMP = 2_000_000_000
"""Nanoseconds that a stamp is ahead of all before: more than sorting leaves, since that looks 1 s ahead."""
_LONGEST_WAIT = 500_000_000
"""Nanoseconds for odometry; a bag whose odometry pauses for longer is mapped by its scans: by judgement."""


def in_order(items: Iterable[Item], counts: Counter[str]) -> Iterator[Item]:
    """Sort what is out of order by up to a second; drop, and count, what comes later than that or twice.

    Of equal stamps odometry goes first.
    """
    waiting: list[tuple[int, bool, int, Item]] = []
    # The second newest stamp drives time on, so that one stamp far in the future cannot.
    newest = second = -(2**63)
    released = _Released(counts)
    for arrival, item in enumerate(items):
        stamp = item.stamp
        if stamp > newest:
            newest, second = stamp, newest
        elif stamp > second:
            second = stamp
        heapq.heappush(waiting, (stamp, isinstance(item, Scan), arrival, item))
        while waiting and (waiting[0][0] <= second - _HORIZON or len(waiting) > _MOST_WAITING):
            if released.accepts(*(head := heapq.heappop(waiting))[:3]):
                yield head[3]
    while waiting:
        if released.accepts(*(head := heapq.heappop(waiting))[:3]):
            yield head[3]


class _Released:
    """Remembers what went out, to refuse what must not follow it."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._stamps = [-(2**63), -(2**63)]
        self._arrival = -1

    def accepts(self, stamp: int, is_scan: bool, arrival: int) -> bool:
        overtaken = self._arrival - arrival
        jump = stamp - max(self._stamps)
        if stamp == self._stamps[is_scan]:
            self._counts["dropped_duplicates"] += 1
            return False
        is_astray = overtaken > _OVERTAKEN_FAR or (overtaken > _OVERTAKEN and jump > _JUMP)
        if stamp < self._stamps[is_scan] or is_astray:
            self._counts["dropped_out_of_order"] += 1
            return False
        self._stamps[is_scan] = stamp
        self._arrival = max(self._arrival, arrival)
        return True


def after_their_odometry(items: Iterable[Item], counts: Counter[str]) -> Iterator[Item]:
    """Hold each scan back until odometry covers its last beam, or half a second of log has passed."""
    held = HeldScans(counts)
    for item in items:
        yield from held.add(item)
    yield from held.rest()


class HeldScans:
    """Scans that wait for the odometry that covers them."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._waiting: deque[tuple[int, Scan]] = deque()
        self._covered = -(2**63)

    def add(self, item: Item) -> Iterator[Item]:
        """Take an item in the order of time; what need not wait any longer."""
        if isinstance(item, Scan):
            self._waiting.append((item.stamp + int(max(item.time_offsets.max(), 0.0) * 1e9), item))
        else:
            self._covered = item.stamp
            yield item
        waiting = self._waiting
        while waiting and (waiting[0][0] <= self._covered or item.stamp > waiting[0][0] + _LONGEST_WAIT):
            end, scan = waiting.popleft()
            self._counts["scans_without_odometry"] += end > self._covered
            yield scan

    def rest(self) -> Iterator[Item]:
        """All that still wait."""
        self._counts["scans_without_odometry"] += len(self._waiting)
        while self._waiting:
            yield self._waiting.popleft()[1]
