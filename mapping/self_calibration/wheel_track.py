"""The wheels beside a scan track: what they say of the same moments, also where their clock or signs err."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.maps.geometry.se2 import Pose, between, wrap_angle
from racecar.maps.sensing.odometry import FASTEST, Odometry
from racecar.maps.sensing.yaw_rate import YawRate

_WINDOW = 1_000_000_000
"""Nanoseconds over which motions are compared, since in less the noise of a track hides slow ones."""
_MAX_WINDOW = 2_000_000_000
"""Nanoseconds beyond which there is a gap in a window; by judgement: twice its length."""
_WINDOW_STEP = 500_000_000
"""Nanoseconds from the beginning of one to that of the next; by judgement: they overlap by half."""


class WheelSigns(Enum):
    """How the poses of the wheels may have to be read; each is multiplied by `factors`."""

    AS_RECORDED = "as recorded"
    MIRRORED = "mirrored"
    """Left is right: x stands, y and yaw count backwards."""
    YAW_INVERTED = "yaw inverted"
    """The place is right, but the yaw counts backwards."""

    @property
    def factors(self) -> Pose:
        """(3,) for x, y and yaw."""
        return np.array(
            {"as recorded": [1, 1, 1], "mirrored": [1, -1, -1], "yaw inverted": [1, 1, -1]}[self.value], float
        )


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
class Windows:
    """W stretches of time, each from one scan of a track to a later one."""

    begins: NDArray[np.int64]
    """(W,) indices of scans."""
    ends: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MotionPairs:
    """W motions, as the scans and as the wheels have them."""

    by_scans: Pose
    """(W, 3) of the laser, in its frame at the beginning."""
    by_wheels: Pose
    """(W, 3) of the base, in its frame at the beginning."""


def windows_of(track: ScanTrack) -> Windows:
    """Stretches of the window's length, one after the other; over a gap there is none."""
    ends = np.searchsorted(track.stamps, track.stamps + _WINDOW)
    nexts = np.searchsorted(track.stamps, track.stamps + _WINDOW_STEP)
    chosen, index = [], 0
    while index < len(track) and ends[index] < len(track):
        end = int(ends[index])
        duration = track.stamps[end] - track.stamps[index]
        if track.segment[index] == track.segment[end] and duration < _MAX_WINDOW:
            chosen.append((index, end))
        index = int(nexts[index])
    begins_and_ends = np.array(chosen, dtype=np.int64).reshape(-1, 2)
    return Windows(begins_and_ends[:, 0], begins_and_ends[:, 1])


def motion_pairs(track: ScanTrack, wheels: WheelTrack, windows: Windows, lag: int) -> MotionPairs:
    """Motions in those windows that the wheels cover, whose samples are stamped ``lag`` nanoseconds later
    than scans; where the wheels jump there is none."""
    begins, ends = track.stamps[windows.begins] + lag, track.stamps[windows.ends] + lag
    is_covered = wheels.covers(begins) & wheels.covers(ends)
    begins, ends = begins[is_covered], ends[is_covered]
    poses = track.track_from_laser
    by_scans = between(poses[windows.begins[is_covered]], poses[windows.ends[is_covered]])
    by_wheels = between(wheels.at(begins), wheels.at(ends)) if len(begins) else np.zeros((0, 3))
    most = FASTEST * (ends - begins) * 1e-9
    is_motion = np.hypot(by_wheels[:, 0], by_wheels[:, 1]) < most
    by_scans[:, 2], by_wheels[:, 2] = wrap_angle(by_scans[:, 2]), wrap_angle(by_wheels[:, 2])
    return MotionPairs(by_scans[is_motion], by_wheels[is_motion])
