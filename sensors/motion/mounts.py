"""The lasers' mounting poses on a car that has several.

All motion is that of one laser, the reference, whichever one took a scan. So dead reckoning, guesses and
odometry faults are the same as with one laser. Scans and keyframes stay in the frame of the laser that took
them, since rays, bearings and occlusion depend on its position.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.sensors.scan import Scan


class Mounts:
    """Mounts by laser number; the reference is the laser of the first scan."""

    def __init__(self) -> None:
        self._places: dict[int, Pose] = {}

    @property
    def base_from_reference(self) -> Pose:
        """(3,)"""
        return next(iter(self._places.values()), IDENTITY)

    @property
    def are_one(self) -> bool:
        """Whether all scans so far came from one laser."""
        return len(self._places) < 2

    def is_further(self, laser: int) -> bool:
        """Whether a laser is not the reference."""
        return laser != next(iter(self._places), laser)

    def take(self, scan: Scan) -> Pose | None:
        """Store the mount of a scan's laser, which may become known late. Returns the resulting motion (3,)
        of the reference, None if there is none."""
        before = self.base_from_reference
        self._places[scan.laser] = scan.base_from_laser
        after = self.base_from_reference
        return None if np.array_equal(before, after) else between(before, after)

    def of(self, laser: int) -> Pose | None:
        """(3,) ``reference_from_laser``; None for the reference itself."""
        if not self.is_further(laser):
            return None
        return between(self.base_from_reference, self._places[laser])

    def laser_from_base(self, lasers: Sequence[int]) -> Pose:
        """(N, 3) ``laser_from_base`` of lasers (N,)."""
        return self._each(lasers, {laser: inverse(place) for laser, place in self._places.items()})

    def to_reference(self, world_from_laser: Pose, lasers: Sequence[int]) -> Pose:
        """Poses (N, 3) of the reference, from poses (N, 3) of lasers (N,)."""
        if self.are_one:
            return world_from_laser
        return compose(world_from_laser, inverse(self._reference_from(lasers)))

    def to_laser(self, world_from_reference: Pose, lasers: Sequence[int]) -> Pose:
        """Poses (N, 3) of lasers (N,), from poses (N, 3) of the reference."""
        if self.are_one:
            return world_from_reference
        return compose(world_from_reference, self._reference_from(lasers))

    def motions_of_reference(
        self,
        motions: Pose,
        first: Sequence[int] | NDArray[np.int64],
        second: Sequence[int] | NDArray[np.int64],
    ) -> Pose:
        """Motions (N, 3) of the reference, from motions (N, 3) that lead from the first lasers (N,) to the
        second ones (N,)."""
        if self.are_one:
            return motions
        moved = compose(self._reference_from(first), motions)
        return compose(moved, inverse(self._reference_from(second)))

    def _reference_from(self, lasers: Sequence[int] | NDArray[np.int64]) -> Pose:
        """(N, 3) ``reference_from_laser`` of lasers (N,)."""
        mounts = {laser: self.of(laser) for laser in self._places}
        return self._each(lasers, {k: IDENTITY if mount is None else mount for k, mount in mounts.items()})

    def _each(self, lasers: Sequence[int] | NDArray[np.int64], poses: dict[int, Pose]) -> Pose:
        numbers: NDArray[np.int64] = np.array(lasers, dtype=np.int64)
        each = np.tile(next(iter(poses.values()), IDENTITY), (len(numbers), 1))
        for laser, pose in poses.items():
            each[numbers == laser] = pose
        return each
