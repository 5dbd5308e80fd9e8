"""What a sensor with many rows saw at each keyframe of a drive, kept on request for outputs in space."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from racecar.maps.sensing.cloud import Cloud


class KeyframeClouds:
    """Clouds by keyframe, as these are numbered in the drive.

    A keyframe has none when its sensor is planar, when it was trimmed, or when it was placed before the
    mapper went on from a checkpoint, which does not hold them."""

    def __init__(self) -> None:
        self._by_keyframe: dict[int, Cloud] = {}

    def __len__(self) -> int:
        return len(self._by_keyframe)

    def __iter__(self) -> Iterator[tuple[int, Cloud]]:
        """Keyframe and cloud, in the order of the keyframes."""
        return iter(self._by_keyframe.items())

    def add(self, keyframe: int, points: NDArray[np.float64]) -> None:
        """Keep points (N, 3) of a keyframe: metres in its laser frame laid level, corrected for motion."""
        taken_at_once = np.zeros(len(points), dtype=np.float32)
        self._by_keyframe[keyframe] = Cloud(points.astype(np.float32), taken_at_once)

    def trim(self, keyframes: NDArray[np.int64]) -> None:
        """Forget the clouds of some keyframes."""
        for keyframe in keyframes.tolist():
            self._by_keyframe.pop(keyframe, None)
