"""Learns the lag between the clocks of wheels and scans from the turns that both measure.

Odometry integrated from commands runs a tenth of a second ahead of the car; over a slow bus it lags behind.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.findings import Finding
from racecar.sensors.motion.lag_estimate import Blocks, blocks_of, known_lag
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.motion.turn_windows import TurnWindows, turn_windows

NOTICEABLE = 100_000_000
"""Nanoseconds of lag above which it is reported, since a turn of 1 rad/s then puts wheels 6° off. Chosen by
judgement. Buses and drivers delay by less, which is corrected all the same."""
_STEP = 20_000_000
"""Nanoseconds between tested lags. Chosen by judgement: the usual time between two odometry messages."""
_LAGS = np.arange(-25, 26) * _STEP
"""(L,) nanoseconds: half a second to each side. That is somewhat more than the largest lag that is not
corrected by shifting a clock beforehand, since a lag at the bound is never accepted."""
_WINDOW, _MAX_WINDOW = 0.5, 1.5
"""Seconds over which turns are compared, and the length at which a window has a gap. Chosen by judgement:
over a shorter time, scans skewed by wheels at a wrong time would seem to agree with them."""
_MAX_WAITING = 200
"""Maximum number of scans that wait for later odometry, since it may have stopped."""
_MAX_DISAGREEMENT = 0.3
"""Radians at which the disagreement between wheels and scans is capped. Chosen by judgement: a slip."""
_TURN_UNTIL_SETTLED = 4.0
"""Radians of absolute turn after which a lag given beforehand is dropped if the turns do not show it. Chosen
by judgement: two turns on the spot would show it."""
_MAX_BLOCKS = 200
"""Number of blocks kept, because clocks drift: a few minutes of driving."""


def lag_finding(lag: int) -> Finding:
    """That odometry stamps lag behind the scans' by nanoseconds, or are ahead of them if negative."""
    return Finding("odometry_lags", milliseconds=abs(lag) / 1e6, side="behind" if lag > 0 else "ahead of")


class KnownLag(NamedTuple):
    """A lag as learned at one moment."""

    nanoseconds: int
    """Delay after a scan's stamp at which the wheels report the car where that scan saw it."""
    is_settled: bool
    """Whether the car has turned enough to determine the lag, or to rule one out."""


class OdometryLag:
    """Tracks how much the wheels and the scans disagreed recently, for each tested lag."""

    def __init__(self, nanoseconds: int = 0) -> None:
        self.nanoseconds = nanoseconds
        """Delay after a scan's stamp at which the wheels report the car where that scan saw it."""
        self._blocks = Blocks.none(len(_LAGS))
        self._turned = 0.0
        self._stamps: list[int] = []
        self._headings: list[float] = []

    def add_turn(self, stamp: int, turn: float) -> None:
        """Add the radians that a scan at ``stamp`` (nanoseconds) was found turned from the previous one."""
        self._stamps.append(stamp)
        self._headings.append(turn + (self._headings[-1] if self._headings else 0.0))

    @property
    def known(self) -> KnownLag:
        """The lag learned so far."""
        return KnownLag(self.nanoseconds, self._turned > _TURN_UNTIL_SETTLED)

    def learn(self, odometry: OdometryBuffer) -> bool:
        """Compare the scans since the last call with the wheels; returns whether the lag has changed.

        A lag given beforehand holds until the turns show another, or many turns show none.
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
        """Windows in which both turned, among the waiting scans (N,) that the wheels' samples (M,) cover by
        now; scans that begin no later window are removed from the queue."""
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
    """Nanoseconds between samples. Motion between them is interpolated, so no shorter lag can be detected."""
    return float(np.median(np.diff(stamps))) if len(stamps) > 1 else np.inf
