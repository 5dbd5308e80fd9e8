"""The lag between the clocks of the wheels and of the scans, learned from the turns that both measure.

Odometry integrated from commands runs a tenth of a second ahead of the car; over a slow bus it is behind.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.motion.lag_estimate import Blocks, blocks_of, known_lag
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.motion.turn_windows import TurnWindows, turn_windows

NOTICEABLE = 100_000_000
"""Nanoseconds of lag from which it is worth a word, since a turn of 1 rad/s then puts wheels 6° off: by
judgement. Buses and drivers delay by less, which is corrected all the same."""
_STEP = 20_000_000
"""Nanoseconds from one lag tried to the next. By judgement: the usual time between two odometry messages."""
_LAGS = np.arange(-25, 26) * _STEP
"""(L,) nanoseconds: half a second to each side, some more than those up to which no clock is shifted
beforehand, since at the bound none is known."""
_WINDOW, _MAX_WINDOW = 0.5, 1.5
"""Seconds over which turns are compared, and beyond which there is a gap in it. By judgement: over a shorter
time, scans skewed by wheels at a wrong time would seem to agree with them."""
_MAX_WAITING = 200
"""Scans that wait for odometry that has not come yet, since it may have stopped."""
_MAX_DISAGREEMENT = 0.3
"""Radians by which turns of wheels and scans may differ; more counts as much. By judgement: a slip."""
_TURN_UNTIL_SETTLED = 4.0
"""Radians that the car must have turned, to and fro, until a lag that the turns do not show is no longer
believed from elsewhere. By judgement: two turns on the spot would show it."""
_MAX_BLOCKS = 200
"""Blocks that are remembered, because clocks drift: some minutes of driving."""


class KnownLag(NamedTuple):
    """A lag as it was learned at one moment."""

    nanoseconds: int
    """How long after a scan's stamp the wheels report the car where that scan saw it."""
    is_settled: bool
    """Whether the car has turned enough to know the lag well, or to know that there is none."""


class OdometryLag:
    """Keeps, for each lag that is tried, by how much the wheels and the scans disagreed of late."""

    def __init__(self, nanoseconds: int = 0) -> None:
        self.nanoseconds = nanoseconds
        """How long after a scan's stamp the wheels report the car where that scan saw it."""
        self._blocks = Blocks.none(len(_LAGS))
        self._turned = 0.0
        self._stamps: list[int] = []
        self._headings: list[float] = []

    def add_turn(self, stamp: int, turn: float) -> None:
        """Take by how many radians a scan, at ``stamp`` (nanoseconds), was found turned from the last one."""
        self._stamps.append(stamp)
        self._headings.append(turn + (self._headings[-1] if self._headings else 0.0))

    @property
    def known(self) -> KnownLag:
        """What is learned by now."""
        return KnownLag(self.nanoseconds, self._turned > _TURN_UNTIL_SETTLED)

    def learn(self, odometry: OdometryBuffer) -> bool:
        """Compare the scans since the last time with the wheels; returns whether the lag has changed.

        One that is known from elsewhere holds until the turns show another, or many of them none.
        """
        stamps, poses = odometry.samples
        scans = np.array(self._stamps, dtype=np.int64)
        windows = self._compare(scans, stamps, np.unwrap(poses[:, 2]))
        missed = np.minimum(np.abs(windows.turns - windows.by_other), _MAX_DISAGREEMENT)
        numbers, costs = self._blocks.joined(blocks_of(scans[windows.begins], missed / windows.scans_apart))
        self._blocks = Blocks(numbers[-_MAX_BLOCKS:], costs[-_MAX_BLOCKS:])
        self._turned += windows.turned
        before, lag = self.nanoseconds, known_lag(_LAGS, self._blocks)
        if lag is not None:
            self.nanoseconds = lag if abs(lag) >= _period(stamps) else 0
        elif self.known.is_settled:
            self.nanoseconds = 0
        return self.nanoseconds != before

    def _compare(
        self, scans: NDArray[np.int64], stamps: NDArray[np.int64], by_wheels: NDArray[np.float64]
    ) -> TurnWindows:
        """Windows in which both turned, of those of the waiting scans (N,) that samples of the wheels (M,)
        cover by now; scans that begin no later one need not wait any more."""
        headings = np.array(self._headings)
        windows = turn_windows((scans, headings), (stamps, by_wheels), _LAGS, _WINDOW, _MAX_WINDOW)
        reached = scans[scans < stamps[-1] - _LAGS[-1]] if len(stamps) > 0 else scans
        last = reached[-1:] - round(_WINDOW * 1e9)
        count = int((scans <= last).sum()) if len(last) else 0
        self._stamps = self._stamps[count:][-_MAX_WAITING:]
        self._headings = self._headings[count:][-_MAX_WAITING:]
        is_whole = windows.is_covered.all(axis=0) & (windows.begins < count)
        return windows.chosen(is_whole).turning()


def _period(stamps: NDArray[np.int64]) -> float:
    """Nanoseconds between samples; between two of them the motion is interpolated, so no shorter lag
    shows."""
    return float(np.median(np.diff(stamps))) if len(stamps) > 1 else np.inf
