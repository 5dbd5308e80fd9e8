"""The recordings that a session was made of, and when each keyframe was seen in them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.arrays import Arrays


@dataclass(frozen=True)
class Recording:
    """One drive."""

    name: str
    """The bag's, or another that people know; empty if it has none."""
    begin: int
    """Stamp of its first scan in nanoseconds."""
    end: int
    """Stamp of its last scan in nanoseconds."""
    drive: int = 0
    """Its rank in time. Recordings of which none is known to be newer have the same."""


@dataclass(frozen=True, eq=False)
class KeyframeTimes:
    """Stamps and recordings of K keyframes."""

    stamps: NDArray[np.int64]
    """(K,) nanoseconds."""
    numbers: NDArray[np.int32]
    """(K,) number of each keyframe's recording."""
    recordings: tuple[Recording, ...]
    """Those of which no keyframe remains are in the map all the same."""

    @classmethod
    def of(cls, recording: Recording, stamps: NDArray[np.int64]) -> "KeyframeTimes":
        """Keyframes with stamps (K,) in nanoseconds, all of one recording."""
        return cls(stamps, np.zeros(len(stamps), dtype=np.int32), (recording,))

    @property
    def drives(self) -> NDArray[np.int32]:
        """(K,) rank in time of each keyframe's recording."""
        return np.array([each.drive for each in self.recordings], dtype=np.int32)[self.numbers]

    @property
    def seconds(self) -> NDArray[np.float64]:
        """(K,) seconds since the begin of each keyframe's recording."""
        begins = np.array([each.begin for each in self.recordings], dtype=np.int64)
        return np.asarray((self.stamps - begins[self.numbers]) * 1e-9, dtype=np.float64)

    @property
    def are_of_last(self) -> NDArray[np.bool_]:
        """(K,) whether a keyframe is of the recording that was added last."""
        are: NDArray[np.bool_] = self.numbers == len(self.recordings) - 1
        return are

    def driven(self, poses: Pose) -> NDArray[np.float64]:
        """(K - 1,) metres of each step of the keyframes at ``poses`` (K, 3); 0 from one recording to
        another."""
        steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        return np.where(np.diff(self.numbers) == 0, steps, 0.0)

    def only(self, chosen: NDArray[np.bool_]) -> "KeyframeTimes":
        """Those of the selected keyframes (K,)."""
        return replace(self, stamps=self.stamps[chosen], numbers=self.numbers[chosen])

    def followed_by(self, later: "KeyframeTimes", *, is_newer: bool) -> "KeyframeTimes":
        """Both, one after the other. If the later ones are not known to be newer, the last drives of both
        count as simultaneous."""
        own, other = (max(each.drive for each in times.recordings) for times in (self, later))
        first, second = (0, own + 1) if is_newer else (max(other - own, 0), max(own - other, 0))
        recordings = [replace(each, drive=each.drive + first) for each in self.recordings]
        recordings += [replace(each, drive=each.drive + second) for each in later.recordings]
        return KeyframeTimes(
            np.concatenate([self.stamps, later.stamps]),
            np.concatenate([self.numbers, len(self.recordings) + later.numbers]).astype(np.int32),
            tuple(recordings),
        )

    def to_arrays(self) -> Arrays:
        """By the names documented in `Session`."""
        return {
            "stamps": self.stamps,
            "recordings": self.numbers,
            "names": np.array([each.name for each in self.recordings], dtype=np.str_),
            "spans": np.array([(each.begin, each.end) for each in self.recordings], dtype=np.int64),
            "drives": np.array([each.drive for each in self.recordings], dtype=np.int32),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "KeyframeTimes":
        """Rebuild from `to_arrays`."""
        names, drives = arrays["names"].tolist(), arrays["drives"].tolist()
        recordings = [
            Recording(name, begin, end, drive)
            for name, (begin, end), drive in zip(names, arrays["spans"].tolist(), drives, strict=True)
        ]
        return cls(
            arrays["stamps"].astype(np.int64), arrays["recordings"].astype(np.int32), tuple(recordings)
        )
