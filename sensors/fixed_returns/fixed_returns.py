"""Remove returns that move with the laser before a recording is mapped.

A robot's own posts, its carrier's body, and the floor seen by a tilted laser stay at one bearing and range
while the robot moves, and bias scan matching towards standstill. So each return is compared with earlier and
later scans, by the motion from the wheels or, while these stand, from scan odometry. A return is fixed if
another scan has one at the same bearing and range, although one of the two sees through the place where the
other has it. Walls along the path keep their range too, but lie where the motion predicts.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.sensors.fixed_returns.cells import in_cells
from racecar.sensors.fixed_returns.laser_path import laser_path
from racecar.sensors.fixed_returns.left_out import LeftOut
from racecar.sensors.fixed_returns.vote_kernels import APART, FIXED, LIMITS, WORLD, partners, votes
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_MARGIN = 1_000_000_000
"""Nanoseconds of odometry kept before a block's first scan for interpolation. Chosen by judgement: longer
than the interval between two samples."""
_BLOCK = 10_000_000_000
"""Nanoseconds that are judged together. Chosen by judgement: as long as someone carries a robot."""
_MIN_WORLD = 0.1
"""The motion between two scans is trusted if at least this share of returns, relative to the larger of the
fixed and the other ones, has moved with it, since when wheels spin all returns seem fixed. Measured: usually
0.2 to 0.6."""
_MIN_SCANS = 4
"""Scans, each apart from the last, needed to judge a block. Chosen by judgement: fewer see one thing."""
_MIN_SHARE = 0.08
"""Share of a block's returns, fixed according to both earlier and later scans, from which they are removed.
Measured: aces, fr079 and intel stay below 0.015; posts and cables of a robot, which do no harm, below 0.08;
floors and carriers have up to 0.4."""
_MIN_SHARE_AGAIN = 0.01
"""The same after the first such block: a tilted laser stays tilted, though the floor comes into view and
goes. Chosen by judgement: about the most of clean logs. Measured: without it four in five of the floor's
returns stay (python -m benchmarks worlds --world 'tilted short')."""


@dataclass(eq=False)
class _Block:
    """A block of measurements, and the data needed to judge it."""

    messages: list[Measurement] = field(default_factory=list)
    scans: list[Scan] = field(default_factory=list)
    """(N,) scans of the first laser."""
    poses: Pose = field(default_factory=lambda: np.zeros((0, 3)))
    """(N, 3) poses of the laser."""
    segments: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(N,) segment ids; poses are comparable only within a segment."""


class FixedReturns:
    """Filter measurements in time order, with a delay of two blocks."""

    def __init__(self) -> None:
        self._odometry: list[Odometry] = []
        self._laser: int | None = None
        self._is_proven = False
        self.left_out = LeftOut()
        """Statistics of the removed returns so far."""

    def filtered(self, messages: Iterable[Measurement]) -> Iterator[Measurement]:
        """Yield the same measurements, with fixed returns removed from the scans."""
        before, block = _Block(), None
        for after in self._blocks(messages):
            self._follow(block or before, after)
            if block is not None:
                yield from self._judged(before, block, after)
                before = block
            block = after
        if block is not None:
            yield from self._judged(before, block, _Block())

    def _blocks(self, messages: Iterable[Measurement]) -> Iterator[_Block]:
        """Split measurements into blocks of `_BLOCK` nanoseconds, counted from the first scan. A cloud ends
        its block: clouds are large and not judged, so they are not held back."""
        block, begin = _Block(), None
        for message in messages:
            if isinstance(message, Scan):
                self.left_out.begin(message.stamp)
                if message.cloud is not None or (begin is not None and message.stamp - begin >= _BLOCK):
                    yield block
                    block, begin = _Block(), None
                begin = message.stamp if begin is None else begin
                self._laser = message.laser if self._laser is None else self._laser
                if message.laser == self._laser and message.cloud is None:
                    block.scans.append(message)
            elif isinstance(message, Odometry):
                self._odometry.append(message)
            block.messages.append(message)
        yield block

    def _follow(self, before: _Block, block: _Block) -> None:
        """Track the laser through a block, continuing from the last scan ``before``."""
        if not block.scans:
            return
        path, segments = laser_path([*before.scans[-1:], *block.scans], self._odometry)
        if before.scans:
            path = compose(before.poses[-1], between(path[0], path))[1:]
            segments = before.segments[-1] + segments[1:] - segments[0]
        block.poses, block.segments = path, segments
        last = block.scans[-1].stamp
        self._odometry = [sample for sample in self._odometry if sample.stamp > last - _MARGIN]

    def _judged(self, before: _Block, block: _Block, after: _Block) -> Iterator[Measurement]:
        """The messages of a block, with fixed returns removed from its scans."""
        masks = self._masks(before, block, after) if block.scans else {}
        for message in block.messages:
            mask = masks.get(id(message))
            yield message if mask is None else _without(message, mask)

    def _masks(self, before: _Block, block: _Block, after: _Block) -> dict[int, NDArray[np.bool_]]:
        """(N,) masks of removed beams, by id of the scan."""
        scans = [*before.scans, *block.scans, *after.scans]
        poses = np.concatenate([before.poses, block.poses, after.poses])
        segments = np.concatenate([before.segments, block.segments, after.segments])
        seconds = np.array([(scan.stamp - block.scans[0].stamp) * 1e-9 for scan in scans])
        pairs = partners(poses, segments, seconds, APART)
        first = len(before.scans)
        own = range(first, first + len(block.scans))
        if not self._is_judged(own, scans, poses, pairs):
            return {}
        tallies = [self._tallies(index, scans, poses, pairs[index]) for index in own]
        masks = in_cells(block.scans, tallies)
        for scan, mask in zip(block.scans, masks, strict=True):
            self.left_out.add(scan, mask)
        return {id(scan): mask for scan, mask in zip(block.scans, masks, strict=True) if mask.any()}

    def _is_judged(self, own: range, scans: list[Scan], poses: Pose, pairs: NDArray[np.int64]) -> bool:
        """Whether enough returns of a block are fixed to bias scan matching; tests scans that are apart."""
        count, returns, along, last = 0, 0, 0, -1
        for index in own:
            if last >= 0 and pairs[index, 0] < last:
                continue
            last = index
            if pairs[index].min() < 0:
                continue
            count += 1
            returns += int(np.count_nonzero(scans[index].is_return))
            along += int(np.count_nonzero(self._tallies(index, scans, poses, pairs[index]) == 2))
        least = _MIN_SHARE_AGAIN if self._is_proven else _MIN_SHARE
        is_judged = count >= _MIN_SCANS and along >= least * max(returns, 1)
        self._is_proven = self._is_proven or is_judged
        return is_judged

    def _tallies(
        self, index: int, scans: list[Scan], poses: Pose, others: NDArray[np.int64]
    ) -> NDArray[np.int8]:
        """(N,) sum of votes on a scan's returns by the scans whose relative motion is confirmed."""
        scan = scans[index]
        tallies = np.zeros(len(scan.ranges), dtype=np.int8)
        for other in others[others >= 0].tolist():
            seen = scans[other]
            motion = between(poses[other], poses[index])
            found = votes(scan.ranges, scan.bearings, seen.ranges, seen.bearings, motion, LIMITS)
            along, world = np.count_nonzero(found == FIXED), np.count_nonzero(found == WORLD)
            if world >= _MIN_WORLD * max(along, np.count_nonzero(scan.is_return) - along):
                tallies += found
        return tallies


def _without(message: Measurement, mask: NDArray[np.bool_]) -> Measurement:
    assert isinstance(message, Scan)
    return replace(message, ranges=np.where(mask, np.nan, message.ranges))
