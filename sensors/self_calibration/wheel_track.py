"""The wheels beside a scan track: what they say of the same moments, also where their clock or signs err."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between, wrap_angle
from racecar.sensors.motion.turn_windows import TurnWindows, turn_windows
from racecar.sensors.odometry import FASTEST, Odometry
from racecar.sensors.self_calibration.robust_fit import blocks_at
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.yaw_rate import YawRate

_TURN_WINDOW, _MOTION_WINDOW = 0.5, 1.0
"""Seconds over which turns and motions are compared, since in less the noise of a track hides slow ones, and
over longer turns lags are alike."""
_MAX_WINDOW = 2.0
"""Seconds beyond which there is a gap in a window; by judgement: twice the longer one."""


class WheelSigns(Enum):
    """How the poses of the wheels may have to be read; each is multiplied by `factors`."""

    AS_RECORDED = "as recorded"
    MIRRORED = "mirrored"
    """Left is right: x stands, y and yaw count backwards."""
    YAW_INVERTED = "yaw inverted"
    """The place is right, but the yaw counts backwards."""
    PATH_MIRRORED = "path mirrored"
    """The yaw is right, but the place is its mirror image, as with x and y exchanged."""

    @property
    def factors(self) -> Pose:
        """(3,) for x, y and yaw."""
        sides = -1.0 if self in (WheelSigns.MIRRORED, WheelSigns.PATH_MIRRORED) else 1.0
        return np.array([1.0, sides, -1.0 if self in (WheelSigns.MIRRORED, WheelSigns.YAW_INVERTED) else 1.0])


@dataclass(frozen=True, eq=False)
class WheelTrack:
    """M samples in the order of time."""

    stamps: NDArray[np.int64]
    """(M,) nanoseconds."""
    odom_from_base: Pose
    """(M, 3) the yaw continuous."""

    @staticmethod
    def of(samples: list[Odometry]) -> "WheelTrack":
        """Of samples in any order."""
        stamps = np.array([sample.stamp for sample in samples], dtype=np.int64)
        poses = np.array([sample.odom_from_base for sample in samples]).reshape(-1, 3)
        stamps, first = np.unique(stamps, return_index=True)
        poses = poses[first]
        poses[:, 2] = np.unwrap(poses[:, 2])
        return WheelTrack(stamps, poses)

    @staticmethod
    def of_turns(samples: list[YawRate]) -> "WheelTrack":
        """Of a gyroscope that stands where it is and only turns."""
        stamps, first = np.unique([sample.stamp for sample in samples], return_index=True)
        rates = np.array([samples[index].rate for index in first])
        turns = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(stamps) * 1e-9)])
        return WheelTrack(stamps, turns[:, None] * [0.0, 0.0, 1.0])

    def read_as(self, signs: WheelSigns) -> "WheelTrack":
        """With other signs."""
        return WheelTrack(self.stamps, self.odom_from_base * signs.factors)

    def at(self, stamps: NDArray[np.int64]) -> Pose:
        """(N, 3) at stamps (N,), interpolated."""
        seconds, wanted = (self.stamps - self.stamps[0]) * 1e-9, (stamps - self.stamps[0]) * 1e-9
        return np.column_stack([np.interp(wanted, seconds, part) for part in self.odom_from_base.T])

    def covers(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) whether stamps (N,) lie between the first sample and the last."""
        if len(self.stamps) == 0:
            return np.zeros(len(stamps), dtype=np.bool_)
        covered: NDArray[np.bool_] = (stamps >= self.stamps[0]) & (stamps <= self.stamps[-1])
        return covered


@dataclass(frozen=True, eq=False)
class MotionPairs:
    """W motions that overlap in time, as the scans and as the wheels have them."""

    by_scans: Pose
    """(W, 3) of the laser, in its frame at the beginning."""
    by_wheels: Pose
    """(W, 3) of the base, in its frame at the beginning."""
    begins: NDArray[np.int64]
    """(W,) indices of the scans at which they begin."""
    blocks: NDArray[np.int64]
    """(W,) of time."""

    def chosen(self, which: NDArray[np.bool_]) -> "MotionPairs":
        """Those of them (W,)."""
        return MotionPairs(
            self.by_scans[which], self.by_wheels[which], self.begins[which], self.blocks[which]
        )


def turns_at(
    track: ScanTrack, other: WheelTrack, lags: NDArray[np.int64], length: float = _TURN_WINDOW
) -> TurnWindows:
    """Turns by scans and by another sensor at each lag (L,), from each scan on over a ``length`` of
    seconds."""
    scans = track.stamps, np.unwrap(track.track_from_laser[:, 2])
    windows = turn_windows(scans, (other.stamps, other.odom_from_base[:, 2]), lags, length, _MAX_WINDOW)
    return windows.chosen(track.segment[windows.begins] == track.segment[windows.ends])


def motion_pairs(track: ScanTrack, wheels: WheelTrack, lag: int) -> MotionPairs:
    """Motions in those windows that the wheels cover, whose samples are stamped ``lag`` nanoseconds later
    than scans; where the wheels jump there is none."""
    windows = turns_at(track, wheels, np.array([lag]), _MOTION_WINDOW)
    windows = windows.chosen(windows.is_covered[0])
    begins, ends = track.stamps[windows.begins], track.stamps[windows.ends]
    poses = track.track_from_laser
    by_scans = between(poses[windows.begins], poses[windows.ends])
    by_wheels = between(wheels.at(begins + lag), wheels.at(ends + lag)) if len(begins) else np.zeros((0, 3))
    by_scans[:, 2], by_wheels[:, 2] = wrap_angle(by_scans[:, 2]), wrap_angle(by_wheels[:, 2])
    is_motion = np.hypot(by_wheels[:, 0], by_wheels[:, 1]) < FASTEST * (ends - begins) * 1e-9
    return MotionPairs(by_scans, by_wheels, windows.begins, blocks_at(begins)).chosen(is_motion)
