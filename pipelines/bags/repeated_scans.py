"""Scans that repeat the previous one bit for bit while the car moves, and so contain nothing new.

Laser noise never repeats a scan. A simulator may, but only while its car stands. So a driver, or a node that
forwards its scans, is stuck, and its scans are no better than a gap.
"""

import math
from dataclasses import dataclass

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry, is_jump
from racecar.sensors.scan import Scan

_MOVED = 0.02
"""Least motion of the odometry, in metres or radians, before a repeated scan is dropped: the cell size of
coarse simulators, which return the same scan from anywhere within a cell."""
_DRIFT_WITHIN = 1_000_000_000
"""Nanoseconds within which it must do so; a standing car's odometry may drift. Chosen by judgement."""
_FEWEST_RETURNS = 20
"""Returns per scan; fewer coarse ranges may be equal by chance, and blank scans are. Chosen by judgement."""
_LONG = 0.5
"""Seconds of repeats from which they are reported. Odometry that is stamped late still moves when a simulated
car already stands. Chosen by judgement."""
_MOST = 0.5
"""Share of the recording from which it is more blind than seeing. Chosen by judgement."""


@dataclass(eq=False)
class _Run:
    """A new scan of one laser, and the odometry's motion while it was repeated."""

    scan: Scan
    since: int
    """Stamp of the odometry at ``start``."""
    start: Pose | None
    """(3,)"""
    moved_from: int = 0
    moved_until: int | None = None
    """Stamps of the first and last repeat before which the odometry moved without a long stop in between."""

    @property
    def seconds(self) -> float:
        """Seconds for which the odometry moved."""
        return 0.0 if self.moved_until is None else (self.moved_until - self.moved_from) * 1e-9

    def is_stuck(self, stamp: int) -> bool:
        """Whether a repeat with this stamp is from a stuck laser instead of a standing car."""
        is_moving = self.moved_until is not None and stamp - self.moved_until < _DRIFT_WITHIN
        return is_moving or self.seconds > _LONG

    def moves_to(self, pose: Pose, stamp: int) -> bool:
        """Whether the odometry moved up to a pose (3,)."""
        is_fresh = self.start is None or is_jump(self.start, pose, (stamp - self.since) * 1e-9)
        x, y, turn = (IDENTITY if is_fresh or self.start is None else pose - self.start).tolist()
        has_moved = max(math.hypot(x, y), abs(math.remainder(turn, math.tau))) > _MOVED
        if has_moved:
            self.moved_from = self.moved_from if self.is_stuck(stamp) else stamp
            self.moved_until = stamp
        if has_moved or is_fresh or stamp - self.since > _DRIFT_WITHIN:
            self.since, self.start = stamp, pose
        return has_moved


class RepeatedScans:
    """Finds repeated scans in a drive; scans and odometry come in time order."""

    def __init__(self) -> None:
        self.count = 0
        """Repeats by a stuck laser."""
        self._pose: Pose | None = None
        self._runs: dict[int, _Run] = {}
        self._first: int | None = None
        self._last = 0
        self._longest = self._stuck_seconds = 0.0
        self._listed: float | None = None

    def add_odometry(self, odometry: Odometry) -> None:
        """Update the latest motion."""
        self._pose = odometry.odom_from_base

    def is_repeat(self, scan: Scan) -> bool:
        """Whether the next scan repeats the previous one although the odometry moved in between."""
        self._first = scan.stamp if self._first is None else self._first
        self._last = scan.stamp
        run = self._runs.get(scan.laser)
        if run is None or not _is_same(scan, run.scan):
            self._runs[scan.laser] = _Run(scan, scan.stamp, self._pose)
            return False
        before = run.seconds
        if self._pose is not None and run.moves_to(self._pose, scan.stamp):
            self._note(run, before)
        is_stuck = run.is_stuck(scan.stamp)
        self.count += is_stuck
        return is_stuck

    @property
    def is_stuck(self) -> bool:
        """Whether a laser has been repeating its scan for long while the odometry moves."""
        return any(run.seconds > _LONG for run in self._runs.values())

    @property
    def findings(self) -> list[Finding]:
        """All repeats in one sentence, if there are many."""
        if self._first is None or self._listed is None:
            return []
        return [
            Finding(
                "scans_repeated",
                spoils_map=self._stuck_seconds > _MOST * (self._last - self._first) * 1e-9,
                count=self.count,
                first=self._listed,
                longest=self._longest,
            )
        ]

    def _note(self, run: _Run, before: float) -> None:
        """Record a run that continues, which lasted ``before`` seconds until now."""
        self._longest = max(self._longest, run.seconds)
        if run.seconds > _LONG:
            if self._listed is None and self._first is not None:
                self._listed = (run.moved_from - self._first) * 1e-9
            self._stuck_seconds += run.seconds - (before if before > _LONG else 0.0)


def _is_same(scan: Scan, before: Scan) -> bool:
    """Whether ranges are equal bit for bit, and enough of them to be significant."""
    return np.array_equal(scan.ranges, before.ranges, equal_nan=True) and (
        int(np.count_nonzero(before.is_return)) >= _FEWEST_RETURNS
    )
