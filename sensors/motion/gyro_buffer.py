"""A bounded buffer of the latest yaw rates, integrated to angles."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.sensors.motion.recent_rows import RecentRows
from racecar.sensors.yaw_rate import YawRate

_WIDEST_GAP = 500_000_000
"""Nanoseconds between two samples over which the rate is interpolated; across longer gaps the turn is
unknown. Chosen by judgement: the slowest IMUs publish at 10 Hz and may lose a few messages."""
_LONGEST_EXTRAPOLATION = 150_000_000
"""Nanoseconds past the last sample for which its rate is held: one and a half periods of the slowest IMUs, so
that live the next sample may still be on its way."""


_STUCK_AFTER = 1_000_000_000
"""Nanoseconds of equal samples after which a gyroscope counts as dead, since noise makes any two differ. A
coarse one may repeat a value while the car stands, where it is not needed. Chosen by judgement."""


class GyroReading(NamedTuple):
    """The angle integrated until a stamp; only differences are meaningful."""

    series: int
    """Number of the uninterrupted series of samples."""
    angle: float
    """Radians since an arbitrary time, including the gyroscope's bias."""


def turn_between(before: GyroReading | None, after: GyroReading | None) -> float:
    """Radians as measured; NaN if unknown."""
    if before is None or after is None or before.series != after.series:
        return math.nan
    return after.angle - before.angle


class GyroBuffer(RecentRows):
    """Samples in time order. Supports any number of readers or one writer, but not both at once.

    A gyroscope is dead, and its samples are ignored, while they all have the same value, such as zero, from
    the first one on or for over a second.
    """

    def __init__(self, max_samples: int = 4096) -> None:
        """A row is a rate and an angle: the integral of the rates so far, by the trapezoidal rule."""
        super().__init__(2, max_samples)
        self._series = 0
        self._changed_at: int | None = None
        """Nanoseconds of the last sample that differed from the previous one."""

    @property
    def series(self) -> int:
        """Number of the uninterrupted series of samples."""
        return self._series

    def add(self, sample: YawRate) -> None:
        """Add a sample; one that is not finite, or not newer than the last, is ignored."""
        latest = self.latest_stamp
        if not math.isfinite(sample.rate) or (latest is not None and sample.stamp <= latest):
            return
        if latest is not None and sample.rate != self._rows[-1, 0]:
            if self._changed_at is not None and not self._is_alive:
                self.start_anew()
                latest = None
            self._changed_at = sample.stamp
        angle = 0.0
        if latest is not None:
            if sample.stamp - latest > _WIDEST_GAP:
                self.start_anew()
            else:
                rate, angle = self._rows[-1].tolist()
                angle += 0.5 * (rate + sample.rate) * (sample.stamp - latest) * 1e-9
        self._append(sample.stamp, (sample.rate, angle))

    @property
    def _is_alive(self) -> bool:
        latest, changed_at = self.latest_stamp, self._changed_at
        return latest is not None and changed_at is not None and latest - changed_at <= _STUCK_AFTER

    def start_anew(self) -> None:
        """Start a new series: later samples do not continue earlier ones."""
        self._clear()
        self._series += 1

    def covers(self, stamp: int) -> bool:
        """Whether the samples reach a stamp (nanoseconds), or nearly."""
        latest = self.latest_stamp
        if latest is None or not self._is_alive or stamp > latest + _LONGEST_EXTRAPOLATION:
            return False
        return bool(stamp >= self._stamps[0])

    def reading_at(self, stamp: int) -> GyroReading | None:
        """The reading at a stamp (nanoseconds); None if it is not covered."""
        if not self.covers(stamp):
            return None
        return GyroReading(self._series, float(self.angles_at([stamp])[0]))

    def angles_at(self, stamps: ArrayLike) -> NDArray[np.float64]:
        """Angles (N,) in radians at stamps (N,) in nanoseconds, all in one series.

        The rate is interpolated between samples and held before the first and past the last. Raises
        LookupError while empty.
        """
        if not self._end:
            raise LookupError("no yaw rates yet")
        known, (rates, angles) = self._stamps, self._rows.T
        wanted = np.asarray(stamps, dtype=np.int64)
        left = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, len(known) - 1)
        right = np.minimum(left + 1, len(known) - 1)
        since = (wanted - known[left]) * 1e-9
        apart = np.maximum(known[right] - known[left], 1) * 1e-9
        slope = np.where(since > 0.0, (rates[right] - rates[left]) / apart, 0.0)
        found: NDArray[np.float64] = angles[left] + since * (rates[left] + 0.5 * slope * since)
        return found
