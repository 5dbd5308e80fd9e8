"""The scans of one drive, and how each is known to lie to the keyframes it was taken between.

As arrays; N scans, K keyframes of this drive:

=======================  ================  ================================================================
name                     shape, type       meaning
=======================  ================  ================================================================
stamps                   (N,) int64        nanoseconds
cloud_lengths            (N,) int64        returns of each scan that is held; keyframes are held elsewhere
clouds                   (sum, 2) float32  metres in the laser frame, corrected for motion, thinned
guess_counts             (N,) int64        guesses of each scan; one once the next keyframe is placed
guesses                  (sum, 3) float64  motion of the laser since that keyframe: metres, radians
keyframe_scans           (K,) int64        the scan that each keyframe is
keyframe_from_next       (K-1, 3) float64  motion from one keyframe to the next by the guess that was right
=======================  ================  ================================================================
"""

from array import array
from copy import copy
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays, pack, side_by_side, unpack
from racecar.mapping.keyframes.refinement import guess_scans
from racecar.mapping.matching.scan_store import thin
from racecar.maps.geometry.se2 import Pose, between

_NO_POINTS = np.zeros((0, 2), dtype=np.float32)
_MOST_HELD = 200
"""Scans of one keyframe, beyond which the car stands and shows nothing new."""


@dataclass(eq=False)
class Drive:
    """Grows by one scan at a time; a keyframe is numbered as it comes in this drive."""

    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    clouds: dict[int, NDArray[np.float32]] = field(default_factory=dict)
    """(M, 2) by scan, of those between keyframes that were not given up."""
    keyframe_scans: "array[int]" = field(default_factory=lambda: array("q"))
    _settled: "array[float]" = field(default_factory=lambda: array("f"))
    """The guess that was right of each scan before the last keyframe, flat; it is short, so it is told to
    a micrometre."""
    _guesses: list[Pose] = field(default_factory=list)
    """All of each scan since."""
    _keyframe_from_next: "array[float]" = field(default_factory=lambda: array("d"))

    def __len__(self) -> int:
        return len(self.stamps)

    def keyframe_of(self, scans: NDArray[np.int64]) -> NDArray[np.int64]:
        """The keyframes (M,) that some scans are, or come after."""
        return np.searchsorted(np.array(self.keyframe_scans), scans, side="right") - 1

    @property
    def held_scans(self) -> NDArray[np.int64]:
        """(S,) the scans between keyframes that were not given up."""
        return np.array(list(self.clouds), dtype=np.int64)

    def start_keyframe(self, guesses: Pose, chosen: int) -> None:
        """The next scan is a keyframe; of its guesses (H, 3), and of those since the last, one was right."""
        if self.keyframe_scans:
            self._keyframe_from_next.extend(guesses[chosen])
            for since_last in self._guesses:
                self._settled.extend(_same_kind(since_last, chosen - len(guesses)))
            self._guesses = []
        self.keyframe_scans.append(len(self.stamps))

    def add(self, stamp: int, points: NDArray[np.float64], guesses: Pose) -> None:
        """Take a scan: nanoseconds, points (M, 2) in its frame, guesses (H, 3) of keyframe_from_laser."""
        if 0 < len(self._guesses) <= _MOST_HELD and len(points) > 0:
            self.clouds[len(self)] = thin(points).astype(np.float32)
        self.stamps.append(stamp)
        self._guesses.append(guesses)

    def give_up(self, scans: NDArray[np.int64], map_from_laser: Pose, map_from_keyframe: Pose) -> None:
        """Forget what some scans (M,) saw. They were found to lie at (M, 3) among the keyframes (K, 3); each
        goes with the one before it from now on, which is not the last."""
        before = self.keyframe_of(scans)
        settled, steps = _in_place(self._settled), _in_place(self._keyframe_from_next)
        settled[scans] = between(map_from_keyframe[before], map_from_laser)
        steps[before] = between(map_from_keyframe[before], map_from_keyframe[before + 1])
        for scan in scans.tolist():
            del self.clouds[scan]

    def pack_clouds(self) -> None:
        """Lay what the scans saw side by side."""
        self.clouds = dict(zip(self.clouds, side_by_side(list(self.clouds.values())), strict=True))

    def guess(self, scans: NDArray[np.int64], map_from_keyframe: Pose) -> Pose:
        """map_from_laser (M, 3) of some scans, by the drive's keyframes (K, 3) and the motion since each."""
        latest = np.array([guesses[0] for guesses in self._guesses]).reshape(-1, 3)
        stamps, keyframe_scans = np.array(self.stamps), np.array(self.keyframe_scans)
        begun = keyframe_scans[keyframe_scans < len(stamps)]  # all but one whose scan is still to come
        return guess_scans(
            stamps[scans],
            np.concatenate([_in_place(self._settled), latest])[scans],
            self.keyframe_of(scans),
            _in_place(self._keyframe_from_next),
            stamps[begun],
            map_from_keyframe,
        )

    def frozen(self) -> "Drive":
        """The same as it is now; it does not grow."""
        return Drive(*(copy(getattr(self, each.name)) for each in fields(self)))

    def to_arrays(self) -> Arrays:
        """The arrays that the module's documentation names."""
        clouds, lengths = pack(list(self.clouds.values()), _NO_POINTS)
        cloud_lengths = np.zeros(len(self), dtype=np.int64)
        cloud_lengths[self.held_scans] = lengths
        latest, latest_counts = pack(self._guesses, np.zeros((0, 3)))
        settled = _in_place(self._settled)
        return {
            "stamps": np.array(self.stamps, dtype=np.int64),
            "clouds": clouds,
            "cloud_lengths": cloud_lengths,
            "guesses": np.concatenate([settled, latest]),
            "guess_counts": np.concatenate([np.ones(len(settled), dtype=np.int64), latest_counts]),
            "keyframe_scans": np.array(self.keyframe_scans, dtype=np.int64),
            "keyframe_from_next": np.array(self._keyframe_from_next).reshape(-1, 3),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "Drive":
        """The drive that was written so."""
        settled = int(arrays["keyframe_scans"][-1])
        clouds = unpack(arrays["clouds"].astype(np.float32), arrays["cloud_lengths"])
        return cls(
            array("q", arrays["stamps"].tolist()),
            {scan: cloud for scan, cloud in enumerate(clouds) if len(cloud) > 0},
            array("q", arrays["keyframe_scans"].tolist()),
            array("f", arrays["guesses"][:settled].ravel().tolist()),
            unpack(arrays["guesses"][settled:].astype(np.float64), arrays["guess_counts"][settled:]),
            array("d", arrays["keyframe_from_next"].ravel().tolist()),
        )


def _in_place(poses: "array[float]") -> NDArray[Any]:
    """(N, 3) that share the memory of poses one after the other; while they are used, none can be added."""
    return np.frombuffer(poses, dtype=poses.typecode).reshape(-1, 3)


def _same_kind(guesses: Pose, from_last: int) -> Pose:
    """The guess (3,) so far from the last one, the most trusted where there are fewer.

    Wheels, which come first, may have told nothing of a scan; so guesses are counted from the last.
    """
    guess: Pose = guesses[max(from_last, -len(guesses))]
    return guess
