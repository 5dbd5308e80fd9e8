"""Sorting of scans, odometry and yaw rates by stamp."""

import heapq
from collections import Counter, deque
from collections.abc import Iterable, Iterator

from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_KINDS = (YawRate, Odometry, Scan)
"""Order of equal stamps: a scan follows the motion that it needs."""

_HORIZON = 1_000_000_000
"""Nanoseconds of log within which messages are sorted; delays are shorter. Chosen by judgement."""
_MOST_WAITING = 10_000
"""Messages, so memory does not grow if stamps stand still."""
_OVERTAKEN_FAR, _OVERTAKEN = 2000, 20
"""A message overtaken by this many later ones is stray; after a jump of its stamp, by the smaller number.
Chosen by judgement."""
_JUMP = 2_000_000_000
"""Nanoseconds by which a stamp is ahead of all before; more than sorting leaves, which looks 1 s ahead."""
_LONGEST_WAIT = 500_000_000
"""Nanoseconds to wait for odometry; after that, the bag is mapped by its scans. Chosen by judgement."""


def in_order(items: Iterable[Measurement], counts: Counter[str]) -> Iterator[Measurement]:
    """Sort items that are out of order by up to a second; drop and count duplicates and later ones.

    For equal stamps the yaw rate comes first and the scan last.
    """
    waiting: list[tuple[int, int, int, Measurement]] = []
    # Time advances with the second newest stamp, so a single stamp far in the future cannot advance it.
    newest = second = -(2**63)
    released = _Released(counts)
    for arrival, item in enumerate(items):
        stamp = item.stamp
        if stamp > newest:
            newest, second = stamp, newest
        elif stamp > second:
            second = stamp
        heapq.heappush(waiting, (stamp, _KINDS.index(type(item)), arrival, item))
        while waiting and (waiting[0][0] <= second - _HORIZON or len(waiting) > _MOST_WAITING):
            if released.accepts(*(head := heapq.heappop(waiting))[:3]):
                yield head[3]
    while waiting:
        if released.accepts(*(head := heapq.heappop(waiting))[:3]):
            yield head[3]


class _Released:
    """Remembers what was passed on, to refuse what must not follow it."""

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._stamps = [-(2**63)] * len(_KINDS)
        self._arrival = -1

    def accepts(self, stamp: int, kind: int, arrival: int) -> bool:
        overtaken = self._arrival - arrival
        jump = stamp - max(self._stamps)
        if stamp == self._stamps[kind]:
            self._counts["dropped_duplicates"] += 1
            return False
        is_astray = overtaken > _OVERTAKEN_FAR or (overtaken > _OVERTAKEN and jump > _JUMP)
        if stamp < self._stamps[kind] or is_astray:
            self._counts["dropped_out_of_order"] += 1
            return False
        self._stamps[kind] = stamp
        self._arrival = max(self._arrival, arrival)
        return True


def after_their_motion(
    items: Iterable[Measurement], counts: Counter[str], *, has_odometry: bool
) -> Iterator[Measurement]:
    """Delay each scan until odometry and yaw rates cover its last beam, or half a second of log has
    passed."""
    held = HeldScans(counts, has_odometry=has_odometry)
    for item in items:
        yield from held.add(item)
    yield from held.rest()


class HeldScans:
    """Scans waiting for the odometry that covers them, and for yaw rates while there are any."""

    def __init__(self, counts: Counter[str], *, has_odometry: bool = True) -> None:
        self._counts = counts
        self._waiting: deque[tuple[int, Scan]] = deque()
        self._has_odometry = has_odometry
        self._covered, self._covered_by_gyro = -(2**63), -(2**63)

    def add(self, item: Measurement) -> Iterator[Measurement]:
        """Add an item in time order; yields items that need not wait any longer."""
        if isinstance(item, Scan):
            self._waiting.append((item.stamp + int(max(item.time_offsets.max(), 0.0) * 1e9), item))
        else:
            if isinstance(item, Odometry):
                self._covered = item.stamp
            else:
                self._covered_by_gyro = item.stamp
            yield item
        waiting = self._waiting
        while waiting and (
            self._is_covered(waiting[0][0], item.stamp) or item.stamp > waiting[0][0] + _LONGEST_WAIT
        ):
            end, scan = waiting.popleft()
            self._count(end)
            yield scan

    def rest(self) -> Iterator[Measurement]:
        """All items still waiting."""
        while self._waiting:
            end, scan = self._waiting.popleft()
            self._count(end)
            yield scan

    def _is_covered(self, end: int, now: int) -> bool:
        gyro_has_stopped = now - self._covered_by_gyro > _LONGEST_WAIT
        is_by_gyro = gyro_has_stopped or self._covered_by_gyro >= end
        return is_by_gyro and (self._covered >= end or not self._has_odometry)

    def _count(self, end: int) -> None:
        self._counts["scans_without_odometry"] += self._has_odometry and end > self._covered
