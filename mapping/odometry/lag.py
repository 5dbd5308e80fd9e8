"""The lag between the clocks of the wheels and of the scans, learned from the turns that both measure.

Odometry integrated from commands runs a tenth of a second ahead of the car; over a slow bus it is behind.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays
from racecar.mapping.odometry.config import OdometryLagConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry_buffer import OdometryBuffer


class KnownLag(NamedTuple):
    """A lag as it was learned at one moment."""

    nanoseconds: int
    """How long after a scan's stamp the wheels report the car where that scan saw it."""
    is_settled: bool
    """Whether the car has turned enough to know the lag well, or to know that there is none."""


class OdometryLag:
    """Sums up, for each lag that is tried, by how much the wheels and the scans disagree."""

    def __init__(self, config: OdometryLagConfig, nanoseconds: int = 0) -> None:
        self.nanoseconds = nanoseconds
        """How long after a scan's stamp the wheels report the car where that scan saw it."""
        self._config = config
        steps = round(config.max_lag / config.step)
        self._lags = np.arange(-steps, steps + 1) * _nanoseconds(config.step)
        """(L,) nanoseconds."""
        self._disagreements = np.zeros(len(self._lags))
        self._turned = 0.0
        self._stamps: list[int] = []
        self._headings: list[float] = []

    def add_turn(self, stamp: int, turn: float) -> None:
        """Take by how many radians a scan, at ``stamp`` (nanoseconds), was found turned from the last one."""
        self._stamps.append(stamp)
        self._headings.append(turn + (self._headings[-1] if self._headings else 0.0))

    @property
    def is_settled(self) -> bool:
        """Whether the car has turned enough to know the lag well, or to know that there is none."""
        return self._turned > self._config.turn_until_settled

    @property
    def known(self) -> KnownLag:
        """What is learned by now."""
        return KnownLag(self.nanoseconds, self.is_settled)

    def learn(self, odometry: OdometryBuffer) -> bool:
        """Compare the scans since the last time with the wheels; returns whether the lag has changed."""
        stamps, poses = odometry.samples
        turns, by_wheels, scans_apart = self._compare(stamps, poses)
        missed = np.minimum(np.abs(turns - by_wheels), self._config.max_disagreement)
        memory = self._config.memory
        self._disagreements = memory * self._disagreements + missed.sum(axis=1)
        self._turned = memory * self._turned + float(np.abs(turns).sum()) / scans_apart
        before, best = self.nanoseconds, int(np.argmin(self._disagreements))
        without_lag = self._disagreements[len(self._lags) // 2]
        share = self._config.max_share_left * min(self._turned / self._config.turn_until_settled, 1.0)
        if self._disagreements[best] < share * without_lag:
            self.nanoseconds = int(self._lags[best]) if abs(self._lags[best]) >= _period(stamps) else 0
        elif self.is_settled:
            self.nanoseconds = 0
        return self.nanoseconds != before

    def _compare(
        self, stamps: NDArray[np.int64], poses: Pose
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Turns (N,) measured by scans, the same by the wheels' samples at each lag (L, N), and over how many
        scans on average."""
        lags, waiting = self._lags, self._config.max_waiting
        scans, headings = np.array(self._stamps, dtype=np.int64), np.array(self._headings)
        ends = np.searchsorted(scans, scans + _nanoseconds(self._config.turn_interval))
        until = stamps[-1] - lags[-1] if len(stamps) > 0 else np.iinfo(np.int64).min
        count = int(np.searchsorted(ends, np.searchsorted(scans, until)))
        ends = ends[:count]
        self._stamps = self._stamps[count:][-waiting:]
        self._headings = self._headings[count:][-waiting:]
        longest = _nanoseconds(self._config.max_turn_interval)
        is_covered = (scans[:count] + lags[0] > stamps[:1]) & (scans[ends] - scans[:count] < longest)
        begins, ends = np.nonzero(is_covered)[0], ends[is_covered]
        if len(begins) == 0:
            return np.zeros(0), np.zeros((len(lags), 0)), 1.0
        wheel_headings = np.unwrap(poses[:, 2])
        seconds = (stamps - scans[0]) * 1e-9
        at = np.interp((scans - scans[0] + lags[:, None]) * 1e-9, seconds, wheel_headings)
        return headings[ends] - headings[begins], at[:, ends] - at[:, begins], float(np.mean(ends - begins))

    def to_arrays(self) -> Arrays:
        """The lag in ``nanoseconds``, the ``disagreements`` (L,), how far the car ``turned``, and ``stamps``
        and ``headings`` (N,) of scans that are still to be compared; angles in radians."""
        return {
            "nanoseconds": np.array(self.nanoseconds),
            "disagreements": self._disagreements,
            "turned": np.array(self._turned),
            "stamps": np.array(self._stamps, dtype=np.int64),
            "headings": np.array(self._headings),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays, config: OdometryLagConfig) -> "OdometryLag":
        """One that goes on from where another was."""
        known = cls(config, int(arrays["nanoseconds"]))
        known._disagreements = arrays["disagreements"].astype(np.float64)
        known._turned = float(arrays["turned"])
        known._stamps, known._headings = arrays["stamps"].tolist(), arrays["headings"].tolist()
        return known


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)


def _period(stamps: NDArray[np.int64]) -> float:
    """Nanoseconds between samples; between two of them the motion is interpolated, so no shorter lag
    shows."""
    return float(np.median(np.diff(stamps))) if len(stamps) > 1 else np.inf
