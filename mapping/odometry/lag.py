"""How far the clock of the wheels is off that of the scans, learned from the turns that both tell of.

Odometry made of what was commanded runs a tenth of a second ahead of the car; over a slow bus it is behind.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import OdometryBuffer

_LAGS = np.arange(-15, 16) * 20_000_000
"""Nanoseconds that are tried."""
_NONE = int(np.searchsorted(_LAGS, 0))
_OVER, _LONGEST = 500_000_000, 1_500_000_000
"""Nanoseconds over which turns are compared, and at most; a longer time has a gap in it. Over a shorter one,
scans skewed by wheels at a wrong time would seem to agree with them."""
_MOST_WAITING = 200
"""Scans that wheels do not reach yet; they may have stopped."""
_LARGEST = 0.3
"""Radians by which a turn that the wheels and the scans tell can differ; more are as bad."""
_ENOUGH, _CLEARLY = 4.0, 0.8
"""Radians that the car must have turned, to and fro, until the best lag may leave that share of what the
wheels and the scans disagree without one. Sooner it must leave less: a slip in one curve looks like a lag."""
_REMEMBERED = 0.97
"""Weight of what was learned before, each time that something is learned."""


class OdometryLag:
    """Sums up, for each lag, by how much the wheels and the scans disagree."""

    def __init__(self, nanoseconds: int = 0) -> None:
        self.nanoseconds = nanoseconds
        """After a scan's stamp, when the wheels tell of that scan."""
        self._disagreements = np.zeros(len(_LAGS))
        self._turned = 0.0
        self._stamps: list[int] = []
        self._headings: list[float] = []

    def add_turn(self, stamp: int, turn: float) -> None:
        """Take by how many radians a scan, at ``stamp`` (nanoseconds), was found turned from the last one."""
        self._stamps.append(stamp)
        self._headings.append(turn + (self._headings[-1] if self._headings else 0.0))

    @property
    def is_settled(self) -> bool:
        """Whether the car has turned enough to tell it well, or to tell that there is none."""
        return self._turned > _ENOUGH

    def learn(self, odometry: OdometryBuffer) -> bool:
        """Compare the scans since the last time with the wheels; tells whether the lag is another now."""
        stamps, poses = odometry.samples
        turns, by_wheels, scans_apart = self._compare(stamps, poses)
        missed = np.minimum(np.abs(turns - by_wheels), _LARGEST)
        self._disagreements = _REMEMBERED * self._disagreements + missed.sum(axis=1)
        self._turned = _REMEMBERED * self._turned + float(np.abs(turns).sum()) / scans_apart
        before, best = self.nanoseconds, int(np.argmin(self._disagreements))
        share = _CLEARLY * min(self._turned / _ENOUGH, 1.0)
        if self._disagreements[best] < share * self._disagreements[_NONE]:
            self.nanoseconds = int(_LAGS[best]) if abs(_LAGS[best]) >= _period(stamps) else 0
        elif self.is_settled:
            self.nanoseconds = 0
        return self.nanoseconds != before

    def _compare(
        self, stamps: NDArray[np.int64], poses: Pose
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Turns (N,) by scans, what the wheels' samples say of them at each lag (L, N), and how many scans
        apart."""
        scans, headings = np.array(self._stamps, dtype=np.int64), np.array(self._headings)
        ends = np.searchsorted(scans, scans + _OVER)
        until = stamps[-1] - _LAGS[-1] if len(stamps) > 0 else np.iinfo(np.int64).min
        count = int(np.searchsorted(ends, np.searchsorted(scans, until)))
        ends = ends[:count]
        self._stamps = self._stamps[count:][-_MOST_WAITING:]
        self._headings = self._headings[count:][-_MOST_WAITING:]
        is_told = (scans[:count] + _LAGS[0] > stamps[:1]) & (scans[ends] - scans[:count] < _LONGEST)
        begins, ends = np.nonzero(is_told)[0], ends[is_told]
        if len(begins) == 0:
            return np.zeros(0), np.zeros((len(_LAGS), 0)), 1.0
        wheel_headings = np.unwrap(poses[:, 2])
        seconds = (stamps - scans[0]) * 1e-9
        at = np.interp((scans - scans[0] + _LAGS[:, None]) * 1e-9, seconds, wheel_headings)
        return headings[ends] - headings[begins], at[:, ends] - at[:, begins], float(np.mean(ends - begins))

    def to_arrays(self) -> Arrays:
        """The lag in ``nanoseconds``, the ``disagreements`` (L,), how far the car ``turned``, and of scans
        that are still to be compared ``stamps`` and ``headings`` (N,); angles in radians."""
        return {
            "nanoseconds": np.array(self.nanoseconds),
            "disagreements": self._disagreements,
            "turned": np.array(self._turned),
            "stamps": np.array(self._stamps, dtype=np.int64),
            "headings": np.array(self._headings),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "OdometryLag":
        """One that goes on from where another was."""
        known = cls(int(arrays["nanoseconds"]))
        known._disagreements = arrays["disagreements"].astype(np.float64)
        known._turned = float(arrays["turned"])
        known._stamps, known._headings = arrays["stamps"].tolist(), arrays["headings"].tolist()
        return known


def _period(stamps: NDArray[np.int64]) -> float:
    """Nanoseconds between samples; between two the way is drawn straight, which tells no lag shorter."""
    return float(np.median(np.diff(stamps))) if len(stamps) > 1 else np.inf
