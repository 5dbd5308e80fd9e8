"""Turns over short windows of time, measured by the scans and by another sensor with its own clock."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_MIN_TURN = 0.05
"""Minimum radians that both must turn in a window to constrain the lag. Chosen by judgement: three degrees,
above noise; it also excludes a turn by hand that the wheels do not measure."""


class TurnWindows(NamedTuple):
    """W overlapping windows, each from one scan to a later one, at L lags of the other sensor's clock."""

    begins: NDArray[np.int64]
    """(W,) indices of scans, ascending."""
    ends: NDArray[np.int64]
    turns: NDArray[np.float64]
    """(W,) radians by the scans."""
    by_other: NDArray[np.float64]
    """(L, W) radians by the other sensor, read at each lag."""
    is_covered: NDArray[np.bool_]
    """(L, W) whether the other sensor has samples for the window."""

    @property
    def scans_apart(self) -> float:
        """Mean number of scans that a window spans, and so how often each turn is counted."""
        return float(np.mean(self.ends - self.begins)) if len(self.begins) else 1.0

    @property
    def turned(self) -> float:
        """Absolute radians that the scans turned."""
        return float(np.abs(self.turns).sum()) / self.scans_apart

    def turning(self) -> "TurnWindows":
        """The windows in which both turn."""
        by_both = np.minimum(np.abs(self.turns), np.abs(self.by_other).max(axis=0, initial=0.0))
        return self.chosen(by_both > _MIN_TURN)

    def chosen(self, which: NDArray[np.bool_]) -> "TurnWindows":
        """The windows selected by a mask (W,)."""
        return TurnWindows(
            self.begins[which],
            self.ends[which],
            self.turns[which],
            self.by_other[:, which],
            self.is_covered[:, which],
        )


def turn_windows(
    scans: tuple[NDArray[np.int64], NDArray[np.float64]],
    other: tuple[NDArray[np.int64], NDArray[np.float64]],
    lags: NDArray[np.int64],
    length: float,
    max_length: float,
) -> TurnWindows:
    """Windows from each scan on, over at least ``length`` seconds, without those of ``max_length`` or more.

    Scans and the other sensor are stamps, nanoseconds ascending, and headings, radians that do not wrap; a
    lag (L,) in nanoseconds is how much later than the scans the other sensor is stamped.
    """
    (stamps, headings), (other_stamps, other_headings) = scans, other
    ends = np.searchsorted(stamps, stamps + round(length * 1e9))
    begins = np.nonzero(ends < len(stamps))[0]
    begins = begins[stamps[ends[begins]] - stamps[begins] < round(max_length * 1e9)]
    ends = ends[begins]
    if len(begins) == 0 or len(other_stamps) < 2:
        none = np.zeros(0, dtype=np.int64)
        empty = np.zeros((len(lags), 0))
        return TurnWindows(none, none, np.zeros(0), empty, empty.astype(np.bool_))
    seconds = (other_stamps - stamps[0]) * 1e-9
    wanted = (stamps - stamps[0] + lags[:, None]) * 1e-9
    at = np.interp(wanted, seconds, other_headings)
    is_covered = (wanted[:, begins] >= seconds[0]) & (wanted[:, ends] <= seconds[-1])
    return TurnWindows(
        begins, ends, headings[ends] - headings[begins], at[:, ends] - at[:, begins], is_covered
    )
