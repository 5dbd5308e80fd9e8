"""Turns over short stretches of time, as the scans and as another sensor with another clock have them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_MIN_TURN = 0.05
"""Radians that both must turn in a window to tell of a lag. By judgement: three degrees; noise shows none,
nor a turn by hand of which the wheels know nothing."""


class TurnWindows(NamedTuple):
    """W stretches that overlap, each from one scan to a later one, beside L lags of the other's clock."""

    begins: NDArray[np.int64]
    """(W,) indices of scans, ascending."""
    ends: NDArray[np.int64]
    turns: NDArray[np.float64]
    """(W,) radians by the scans."""
    by_other: NDArray[np.float64]
    """(L, W) the same by the other sensor, read at each lag."""
    is_covered: NDArray[np.bool_]
    """(L, W) whether it has samples for that."""

    @property
    def scans_apart(self) -> float:
        """How many scans a window spans on average, and so how often each turn is counted."""
        return float(np.mean(self.ends - self.begins)) if len(self.begins) else 1.0

    @property
    def turned(self) -> float:
        """Radians that the scans turned, to and fro."""
        return float(np.abs(self.turns).sum()) / self.scans_apart

    def turning(self) -> "TurnWindows":
        """Those in which both turn."""
        by_both = np.minimum(np.abs(self.turns), np.abs(self.by_other).max(axis=0, initial=0.0))
        return self.chosen(by_both > _MIN_TURN)

    def chosen(self, which: NDArray[np.bool_]) -> "TurnWindows":
        """Those of them (W,)."""
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
    """From each scan on, over ``length`` seconds or a little more, but no gap of ``max_length``.

    Scans and the other sensor are stamps, nanoseconds ascending, and headings, radians that do not wrap; a
    lag (L,) in nanoseconds is how much later than scans the other is stamped.
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
