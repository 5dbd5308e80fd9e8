"""The scans of one drive, and how each is known to lie relative to the keyframes it was taken between.

All motion is that of the reference among the lasers.
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
"""Scans after a keyframe, from which on the car stands and further ones show nothing new, so that they are
not kept. By judgement: five seconds of a fast laser."""


@dataclass(eq=False)
class Drive:
    """Grows by one scan at a time; a keyframe is numbered as it comes in this drive."""

    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    lasers: "array[int]" = field(default_factory=lambda: array("B"))
    """Of the scans, by number."""
    clouds: dict[int, NDArray[np.float32]] = field(default_factory=dict)
    """(M, 2) by scan, of those between keyframes that were not trimmed."""
    keyframe_scans: "array[int]" = field(default_factory=lambda: array("q"))
    _decided: "array[float]" = field(default_factory=lambda: array("f"))
    """The guess that was right of each scan before the last keyframe, flat; it is short, so 32 bits hold it
    to a micrometre."""
    _guesses: list[MotionGuesses] = field(default_factory=list)
    """All of each scan since."""
    _keyframe_from_next: "array[float]" = field(default_factory=lambda: array("d"))

    def __len__(self) -> int:
        return len(self.stamps)

    def keyframe_of(self, scans: NDArray[np.int64]) -> NDArray[np.int64]:
        """The keyframes (M,) that some scans are, or come after."""
        return keyframe_of(scans, np.array(self.keyframe_scans))

    @property
    def keyframe_stamps(self) -> NDArray[np.int64]:
        """(K,) nanoseconds."""
        return np.array(self.stamps, dtype=np.int64)[np.array(self.keyframe_scans, dtype=np.int64)]

    @property
    def kept_scans(self) -> NDArray[np.int64]:
        """(S,) the scans between keyframes that were not trimmed."""
        return np.array(list(self.clouds), dtype=np.int64)

    def start_keyframe(self, guesses: MotionGuesses, right: GuessSource) -> None:
        """The next scan is a keyframe; of its guesses, and of those since the last, one source was right."""
        if self.keyframe_scans:
            decided = [each for since_last in self._guesses for each in since_last.of(right)]
            self._keyframe_from_next.extend(guesses.by[right])
            self._decided.extend(decided)
            self._guesses = []
        self.keyframe_scans.append(len(self.stamps))

    def add(self, stamp: int, points: NDArray[np.float64], guesses: MotionGuesses, laser: int = 0) -> None:
        """Take a scan of a laser: nanoseconds, points (M, 2) in its frame, and guesses of the motion."""
        if 0 < len(self._guesses) <= SCANS_PER_KEYFRAME and len(points) > 0:
            self.clouds[len(self)] = thin(points).astype(np.float32)
        self.stamps.append(stamp)
        self.lasers.append(laser)
        self._guesses.append(guesses)

    def trim(self, scans: NDArray[np.int64], map_from_scan: Pose, map_from_keyframe: Pose) -> None:
        """Forget what some scans (M,) saw. The reference was found to lie at (M, 3) there, and at (K, 3) at
        the keyframes; each goes with the one before it from now on, which is not the last."""
        before = self.keyframe_of(scans)
        decided, steps = _in_place(self._decided), _in_place(self._keyframe_from_next)
        decided[scans] = between(map_from_keyframe[before], map_from_scan)
        steps[before] = between(map_from_keyframe[before], map_from_keyframe[before + 1])
        for scan in scans.tolist():
            del self.clouds[scan]

    def pack_clouds(self) -> None:
        """Move what the scans saw into one block of memory."""
        self.clouds = dict(zip(self.clouds, side_by_side(list(self.clouds.values())), strict=True))

    def guess(self, scans: NDArray[np.int64], map_from_keyframe: Pose) -> Pose:
        """The reference in the map (M, 3) at some scans, from where it was at the keyframes (K, 3) and the
        motion since each."""
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
    """(N, 3) that share the memory of poses one after the other; while they are used, none can be added."""
    return np.frombuffer(poses, dtype=poses.typecode).reshape(-1, 3)
