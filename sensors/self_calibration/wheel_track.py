"""Wheel motion at the times of a scan track, for any lag of clocks and signs."""

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
"""Seconds over which turns and motions are compared, since shorter windows drown slow motion in noise, and
over longer ones turns look alike at all lags."""
_MAX_WINDOW = 2.0
"""Seconds beyond which a window has a gap. Chosen by judgement: twice the longer one."""


class WheelSigns(Enum):
    """Possible sign conventions of the wheels' poses, applied by multiplying with `factors`."""

    AS_RECORDED = "as recorded"
    MIRRORED = "mirrored"
    """Left and right are swapped: x is right, y and yaw have the wrong sign."""
    YAW_INVERTED = "yaw inverted"
    """The position is right, the yaw has the wrong sign."""
    PATH_MIRRORED = "path mirrored"
    """The yaw is right, the position is mirrored, as with x and y swapped."""

    @property
    def factors(self) -> Pose:
        """(3,) signs of x, y and yaw."""
        sides = -1.0 if self in (WheelSigns.MIRRORED, WheelSigns.PATH_MIRRORED) else 1.0
        return np.array([1.0, sides, -1.0 if self in (WheelSigns.MIRRORED, WheelSigns.YAW_INVERTED) else 1.0])


@dataclass(frozen=True, eq=False)
class WheelTrack:
    """M samples in time order."""

    stamps: NDArray[np.int64]
    """(M,) nanoseconds."""
    odom_from_base: Pose
    """(M, 3) poses with unwrapped yaw."""

    @staticmethod
    def of(samples: list[Odometry]) -> "WheelTrack":
        """Build from samples in any order."""
        stamps = np.array([sample.stamp for sample in samples], dtype=np.int64)
        poses = np.array([sample.odom_from_base for sample in samples]).reshape(-1, 3)
        stamps, first = np.unique(stamps, return_index=True)
        poses = poses[first]
        poses[:, 2] = np.unwrap(poses[:, 2])
        return WheelTrack(stamps, poses)

    @staticmethod
    def of_turns(samples: list[YawRate]) -> "WheelTrack":
        """Build from a gyroscope: rotation without translation."""
        stamps, first = np.unique([sample.stamp for sample in samples], return_index=True)
        rates = np.array([samples[index].rate for index in first])
        turns = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(stamps) * 1e-9)])
        return WheelTrack(stamps, turns[:, None] * [0.0, 0.0, 1.0])

    def read_as(self, signs: WheelSigns) -> "WheelTrack":
        """The same track with other signs."""
        return WheelTrack(self.stamps, self.odom_from_base * signs.factors)

    def at(self, stamps: NDArray[np.int64]) -> Pose:
        """(N, 3) interpolated poses at stamps (N,)."""
        seconds, wanted = (self.stamps - self.stamps[0]) * 1e-9, (stamps - self.stamps[0]) * 1e-9
        return np.column_stack([np.interp(wanted, seconds, part) for part in self.odom_from_base.T])

    def covers(self, stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) whether stamps (N,) lie between the first and last sample."""
        if len(self.stamps) == 0:
            return np.zeros(len(stamps), dtype=np.bool_)
        covered: NDArray[np.bool_] = (stamps >= self.stamps[0]) & (stamps <= self.stamps[-1])
        return covered


@dataclass(frozen=True, eq=False)
class MotionPairs:
    """W motions over overlapping windows, by scans and by wheels."""

    by_scans: Pose
    """(W, 3) motion of the laser in its initial frame."""
    by_wheels: Pose
    """(W, 3) motion of the base in its initial frame."""
    begins: NDArray[np.int64]
    """(W,) indices of the first scans."""
    blocks: NDArray[np.int64]
    """(W,) block ids."""

    def chosen(self, which: NDArray[np.bool_]) -> "MotionPairs":
        """The selected windows (W,)."""
        return MotionPairs(
            self.by_scans[which], self.by_wheels[which], self.begins[which], self.blocks[which]
        )


def turns_at(
    track: ScanTrack, other: WheelTrack, lags: NDArray[np.int64], length: float = _TURN_WINDOW
) -> TurnWindows:
    """Turns by scans and by another sensor at each lag (L,), over ``length`` seconds from each scan."""
    scans = track.stamps, np.unwrap(track.track_from_laser[:, 2])
    windows = turn_windows(scans, (other.stamps, other.odom_from_base[:, 2]), lags, length, _MAX_WINDOW)
    return windows.chosen(track.segment[windows.begins] == track.segment[windows.ends])


def motion_pairs(track: ScanTrack, wheels: WheelTrack, lag: int) -> MotionPairs:
    """Motions over the windows that the wheels cover without a jump; wheel stamps are ``lag`` nanoseconds
    later than scans."""
    windows = turns_at(track, wheels, np.array([lag]), _MOTION_WINDOW)
    windows = windows.chosen(windows.is_covered[0])
    begins, ends = track.stamps[windows.begins], track.stamps[windows.ends]
    poses = track.track_from_laser
    by_scans = between(poses[windows.begins], poses[windows.ends])
    by_wheels = between(wheels.at(begins + lag), wheels.at(ends + lag)) if len(begins) else np.zeros((0, 3))
    by_scans[:, 2], by_wheels[:, 2] = wrap_angle(by_scans[:, 2]), wrap_angle(by_wheels[:, 2])
    is_motion = np.hypot(by_wheels[:, 0], by_wheels[:, 1]) < FASTEST * (ends - begins) * 1e-9
    return MotionPairs(by_scans, by_wheels, windows.begins, blocks_at(begins)).chosen(is_motion)
