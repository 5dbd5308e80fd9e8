"""The scans of one drive, and how each is known to lie to the keyframes it was taken between.

As arrays; N scans, K keyframes of this drive:

=======================  ================  ================================================================
name                     shape, type       meaning
=======================  ================  ================================================================
stamps                   (N,) int64        nanoseconds
cloud_lengths            (N,) int64        returns of each scan, 0 of keyframes, which are kept elsewhere
clouds                   (sum, 2) float32  metres in the laser frame, corrected for motion, thinned
after_keyframe           (N,) int64        the keyframe that the scan is, or comes after
guess_counts             (N,) int64        guesses of each scan; one once the next keyframe is placed
guesses                  (sum, 3) float64  motion of the laser since that keyframe: metres, radians
keyframe_scans           (K,) int64        the scan that each keyframe is
keyframe_from_next       (K-1, 3) float64  motion from one keyframe to the next by the guess that was right
=======================  ================  ================================================================
"""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import Arrays, pack, unpack
from mapping.refinement import guess_scans
from mapping.scan_store import thin
from maps.se2 import Pose

_NO_POINTS = np.zeros((0, 2), dtype=np.float32)


@dataclass(eq=False)
class Drive:
    """Grows by one scan at a time; a keyframe is numbered as it comes in this drive."""

    stamps: list[int] = field(default_factory=list)
    clouds: list[NDArray[np.float32]] = field(default_factory=list)
    keyframe_scans: list[int] = field(default_factory=list)
    _after_keyframe: list[int] = field(default_factory=list)
    _guesses: list[Pose] = field(default_factory=list)
    _keyframe_from_next: list[Pose] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def after_keyframe(self) -> NDArray[np.int64]:
        """(N,) the keyframe that each scan is, or comes after."""
        return np.array(self._after_keyframe, dtype=np.int64)

    @property
    def between_keyframes(self) -> NDArray[np.int64]:
        """(N - K,) the scans that are no keyframes."""
        return np.setdiff1d(np.arange(len(self)), self.keyframe_scans)

    def start_keyframe(self, guesses: Pose, chosen: int) -> None:
        """The next scan is a keyframe; of its guesses (H, 3), and of those since the last, one was right."""
        if self.keyframe_scans:
            self._keyframe_from_next.append(guesses[chosen])
            for k in range(self.keyframe_scans[-1], len(self._guesses)):
                self._guesses[k] = _same_kind(self._guesses[k], chosen - len(guesses))[None].copy()
        self.keyframe_scans.append(len(self.stamps))

    def add(self, stamp: int, points: NDArray[np.float64], guesses: Pose) -> None:
        """Take a scan: nanoseconds, points (M, 2) in its frame, guesses (H, 3) of keyframe_from_laser."""
        is_keyframe = self.keyframe_scans[-1:] == [len(self)]
        self.stamps.append(stamp)
        self.clouds.append(_NO_POINTS if is_keyframe else thin(points).astype(np.float32))
        self._after_keyframe.append(len(self.keyframe_scans) - 1)
        self._guesses.append(guesses)

    def guess(self, map_from_keyframe: Pose) -> Pose:
        """map_from_laser (N, 3) of all scans, by the drive's keyframes (K, 3) and the motion since each."""
        return guess_scans(
            np.array([guesses[0] for guesses in self._guesses]),
            self.after_keyframe,
            np.array(self._keyframe_from_next).reshape(-1, 3),
            np.array(self.keyframe_scans),
            map_from_keyframe,
        )

    def frozen(self) -> "Drive":
        """The same as it is now; it does not grow."""
        return Drive(*(list(getattr(self, each.name)) for each in fields(self)))

    def to_arrays(self) -> Arrays:
        """The arrays that the module's documentation names."""
        clouds, cloud_lengths = pack(self.clouds, _NO_POINTS)
        guesses, guess_counts = pack(self._guesses, np.zeros((0, 3)))
        return {
            "stamps": np.array(self.stamps, dtype=np.int64),
            "clouds": clouds,
            "cloud_lengths": cloud_lengths,
            "after_keyframe": self.after_keyframe,
            "guesses": guesses,
            "guess_counts": guess_counts,
            "keyframe_scans": np.array(self.keyframe_scans, dtype=np.int64),
            "keyframe_from_next": np.array(self._keyframe_from_next).reshape(-1, 3),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "Drive":
        """The drive that was written so."""
        return cls(
            arrays["stamps"].tolist(),
            unpack(arrays["clouds"].astype(np.float32), arrays["cloud_lengths"]),
            arrays["keyframe_scans"].tolist(),
            arrays["after_keyframe"].tolist(),
            unpack(arrays["guesses"].astype(np.float64), arrays["guess_counts"]),
            list(arrays["keyframe_from_next"].astype(np.float64)),
        )


def _same_kind(guesses: Pose, from_last: int) -> Pose:
    """The guess (3,) so far from the last one, the most trusted where there are fewer.

    Wheels, which come first, may have told nothing of a scan; so guesses are counted from the last.
    """
    guess: Pose = guesses[max(from_last, -len(guesses))]
    return guess
