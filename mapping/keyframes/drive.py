"""The scans of one drive, each with its motion since the last keyframe.

All motion is that of the reference laser.
"""

from array import array
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.refinement import guess_scans, keyframe_of
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.arrays import side_by_side
from racecar.sensors.matching.scan_store import thin
from racecar.sensors.motion.motion_guesses import GuessSource, MotionGuesses

SCANS_PER_KEYFRAME = 200
"""Scans kept after a keyframe; further ones come from a standing car and show nothing new, so that they can
go. Chosen by judgement: five seconds of a fast laser."""


@dataclass(eq=False)
class Drive:
    """Grows by one scan at a time; keyframes are numbered within this drive."""

    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    lasers: "array[int]" = field(default_factory=lambda: array("B"))
    """Laser index of each scan."""
    clouds: dict[int, NDArray[np.float32]] = field(default_factory=dict)
    """(M, 2) points by scan, of those between keyframes that were not trimmed."""
    keyframe_scans: "array[int]" = field(default_factory=lambda: array("q"))
    _decided: "array[float]" = field(default_factory=lambda: array("f"))
    """The correct guess for each scan before the last keyframe, flat; 32 bits hold such short motions to a
    micrometre."""
    _guesses: list[MotionGuesses] = field(default_factory=list)
    """All guesses for each scan since."""
    _keyframe_from_next: "array[float]" = field(default_factory=lambda: array("d"))

    def __len__(self) -> int:
        return len(self.stamps)

    def keyframe_of(self, scans: NDArray[np.int64]) -> NDArray[np.int64]:
        """(M,) keyframes that these scans are, or follow."""
        return keyframe_of(scans, np.array(self.keyframe_scans))

    @property
    def keyframe_stamps(self) -> NDArray[np.int64]:
        """(K,) nanoseconds."""
        return np.array(self.stamps, dtype=np.int64)[np.array(self.keyframe_scans, dtype=np.int64)]

    @property
    def kept_scans(self) -> NDArray[np.int64]:
        """(S,) scans between keyframes that were not trimmed."""
        return np.array(list(self.clouds), dtype=np.int64)

    def start_keyframe(self, guesses: MotionGuesses, right: GuessSource) -> None:
        """Mark the next scan as a keyframe; ``right`` is the correct source of guesses since the last one."""
        if self.keyframe_scans:
            decided = [each for since_last in self._guesses for each in since_last.of(right)]
            self._keyframe_from_next.extend(guesses.by[right])
            self._decided.extend(decided)
            self._guesses = []
        self.keyframe_scans.append(len(self.stamps))

    def add(self, stamp: int, points: NDArray[np.float64], guesses: MotionGuesses, laser: int = 0) -> None:
        """Add a scan: stamp in nanoseconds, points (M, 2) in its laser's frame, and guesses of the motion."""
        if 0 < len(self._guesses) <= SCANS_PER_KEYFRAME and len(points) > 0:
            self.clouds[len(self)] = thin(points).astype(np.float32)
        self.stamps.append(stamp)
        self.lasers.append(laser)
        self._guesses.append(guesses)

    def trim(self, scans: NDArray[np.int64], map_from_scan: Pose, map_from_keyframe: Pose) -> None:
        """Drop the points of some scans (M,), with the reference at (M, 3), and at (K, 3) at the keyframes.
        Each then moves rigidly with its keyframe, which must not be the last."""
        before = self.keyframe_of(scans)
        decided, steps = _in_place(self._decided), _in_place(self._keyframe_from_next)
        decided[scans] = between(map_from_keyframe[before], map_from_scan)
        steps[before] = between(map_from_keyframe[before], map_from_keyframe[before + 1])
        for scan in scans.tolist():
            del self.clouds[scan]

    def pack_clouds(self) -> None:
        """Move all points into one block of memory."""
        self.clouds = dict(zip(self.clouds, side_by_side(list(self.clouds.values())), strict=True))

    def guess(self, scans: NDArray[np.int64], map_from_keyframe: Pose) -> Pose:
        """Dead-reckoned poses (M, 3) of the reference at some scans, from those at the keyframes (K, 3)."""
        latest = np.array([guesses.best for guesses in self._guesses]).reshape(-1, 3)
        return guess_scans(
            np.array(self.stamps),
            scans,
            np.concatenate([_in_place(self._decided), latest])[scans],
            np.array(self.keyframe_scans),
            _in_place(self._keyframe_from_next),
            map_from_keyframe,
        )


def _in_place(poses: "array[float]") -> NDArray[Any]:
    """(N, 3) view of flat poses; nothing may be appended while it exists."""
    return np.frombuffer(poses, dtype=poses.typecode).reshape(-1, 3)
