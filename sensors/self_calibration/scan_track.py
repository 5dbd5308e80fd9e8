"""Track the laser by its scans alone, to check other sensors against it."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.sensors.motion.deskew import by_velocity, deskew
from racecar.sensors.motion.scan_odometry import ScanOdometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.profile_turn import bearing_profile, turn_between

_MIN_INTERVAL = 0.07
"""Minimum interval in seconds between tracked scans, because the laser hardly moves in less: every third scan
of a laser of 40 a second, every one of an RPLIDAR."""
_MAX_INTERVAL = 1.0
"""Seconds between two scans beyond which a new segment begins. Chosen by judgement: a robot can turn anywhere
meanwhile."""
_TURN_SEARCH_INTERVAL = 0.075
"""Interval in seconds from which the rotation is searched. Chosen by judgement: in less, a robot turns by
less than registration tolerates."""
_STANDING_CHANGE = 0.01
"""Metres by which a range must change to count. Chosen by judgement: the resolution of SICK lasers."""
_STANDING_SHARE = 0.05
"""Share of ranges that may change while the laser stands. Chosen by judgement: someone walks by."""
_MAX_POINTS = 400
"""Points of a scan that are registered, for speed. Chosen by judgement: the beams of common lasers."""
_JITTER = 0.02
"""Metres and radians between scans below which motion counts as none. Chosen by judgement: the noise of a
match."""


@dataclass(frozen=True, eq=False)
class ScanTrack:
    """N scans and the laser's poses in the middle of each sweep."""

    scans: list[Scan]
    """(N,)"""
    stamps: NDArray[np.int64]
    """(N,) nanoseconds, in the middle of the sweep, where the pose does not depend on the beam order."""
    track_from_laser: Pose
    """(N, 3)"""
    segment: NDArray[np.int64]
    """(N,) ascending segment ids; only poses of one segment are comparable."""

    def __len__(self) -> int:
        return len(self.stamps)

    def velocities(self) -> Pose:
        """(N, 3) metres and radians per second in the laser's frame, averaged from the previous to the next
        scan; NaN at the ends of a segment."""
        velocities = np.full((len(self), 3), np.nan)
        if len(self) < 3:
            return velocities
        before, after = slice(None, -2), slice(2, None)
        seconds = (self.stamps[after] - self.stamps[before]) * 1e-9
        motion = between(self.track_from_laser[before], self.track_from_laser[after])
        half = -0.5 * motion[:, 2]  # the chord in the frame of the laser halfway
        x, y = motion[:, 0].copy(), motion[:, 1].copy()
        motion[:, 0], motion[:, 1] = (
            np.cos(half) * x - np.sin(half) * y,
            np.sin(half) * x + np.cos(half) * y,
        )
        is_inside = (self.segment[before] == self.segment[after]) & (seconds > 0.0)
        velocities[1:-1][is_inside] = motion[is_inside] / seconds[is_inside, None]
        return velocities


class ScanTracker:
    """Track the laser by registering each scan against earlier ones, with constant velocity as the guess.

    Scans must be in time order. Those within the minimum interval are skipped; those that see the same as the
    last are not registered.
    """

    def __init__(self, sweep_scale: float = 1.0) -> None:
        """``sweep_scale`` multiplies the beams' time offsets about the middle of the sweep: -1 reverses their
        order."""
        self._sweep_scale = sweep_scale
        self._scans: list[Scan] = []
        self._stamps: list[int] = []
        self._poses: list[Pose] = []
        self._segments: list[int] = []
        self._odometry = ScanOdometry()
        self._velocity: Pose = IDENTITY
        self._registered: tuple[Scan, NDArray[np.float64]] | None = None
        self.turned = 0.0
        """Total rotation in radians, either way, without jitter."""
        self.distance = 0.0
        """Path length in metres, without jitter."""

    def __len__(self) -> int:
        return len(self._scans)

    def add(self, scan: Scan) -> bool:
        """Add the next scan; returns whether it is part of the track."""
        stamp = scan.stamp + round(middle_of(scan) * 1e9)
        seconds = (stamp - self._stamps[-1]) * 1e-9 if self._stamps else np.inf
        if seconds < _MIN_INTERVAL:
            return False
        if seconds > _MAX_INTERVAL:
            self._registered = None
        if self._registered is None:
            self._begin_segment(scan, stamp)
        elif _sees_the_same(self._registered[0], scan):
            self._velocity = IDENTITY
            self._append(scan, stamp, self._poses[-1], self._segments[-1])
        else:
            self._register(scan, stamp, seconds)
        return True

    def track(self) -> ScanTrack:
        """The track so far."""
        return ScanTrack(
            self._scans.copy(),
            np.array(self._stamps, dtype=np.int64),
            np.array(self._poses).reshape(-1, 3),
            np.array(self._segments, dtype=np.int64),
        )

    def _begin_segment(self, scan: Scan, stamp: int) -> None:
        self._odometry, self._velocity = ScanOdometry(), IDENTITY
        points = self._points_of(scan)
        number = self._segments[-1] + 1 if self._segments else 0
        self._append(scan, stamp, self._odometry.register(points, IDENTITY), number)
        self._registered = scan, bearing_profile(points)

    def _register(self, scan: Scan, stamp: int, seconds: float) -> None:
        assert self._registered is not None
        points = self._points_of(scan)
        profile, motion = bearing_profile(points), self._velocity * seconds
        if seconds > _TURN_SEARCH_INTERVAL:
            motion[2] = turn_between(self._registered[1], profile, float(motion[2]))
        pose = self._odometry.register(points, motion)
        motion = between(self._poses[-1], pose)
        self._velocity = motion / seconds
        turn, distance = abs(float(motion[2])), float(np.hypot(motion[0], motion[1]))
        self.turned += turn if turn > _JITTER else 0.0
        self.distance += distance if distance > _JITTER else 0.0
        self._append(scan, stamp, pose, self._segments[-1])
        self._registered = scan, profile

    def _points_of(self, scan: Scan) -> NDArray[np.float64]:
        points = deskewed(scan, self._velocity, self._sweep_scale)
        return points[:: 1 + (len(points) - 1) // _MAX_POINTS] if len(points) else points

    def _append(self, scan: Scan, stamp: int, pose: Pose, segment: int) -> None:
        self._scans.append(scan)
        self._stamps.append(stamp)
        self._poses.append(pose)
        self._segments.append(segment)


def track_of(scans: Iterable[Scan], sweep_scale: float = 1.0) -> ScanTrack:
    """Track scans in time order."""
    tracker = ScanTracker(sweep_scale)
    for scan in scans:
        tracker.add(scan)
    return tracker.track()


def deskewed(scan: Scan, velocity: Pose, sweep_scale: float) -> NDArray[np.float64]:
    """Deskewed end points (M, 2) in the laser frame in the middle of the sweep, with the beams' times scaled
    about it."""
    offsets = sweep_scale * (scan.time_offsets - middle_of(scan))
    return deskew(replace(scan, time_offsets=offsets), by_velocity(velocity))


def middle_of(scan: Scan) -> float:
    """Seconds from a scan's stamp to the middle of its sweep."""
    return 0.5 * float(scan.time_offsets.min() + scan.time_offsets.max())


def _sees_the_same(scan: Scan, later: Scan) -> bool:
    """Whether so few returns changed that the laser cannot have moved."""
    if len(scan.ranges) != len(later.ranges):
        return False
    with np.errstate(invalid="ignore"):  # both are misses
        change = np.abs(later.ranges - scan.ranges)
    change = change[np.isfinite(change)]
    moved = np.count_nonzero(change > _STANDING_CHANGE)
    return bool(len(change) > 0 and moved < _STANDING_SHARE * len(change))
