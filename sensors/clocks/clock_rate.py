"""Detects clocks that run at different rates, from the drift of their stamps against recording times."""

import numpy as np

from racecar.sensors.even_sample import EvenSample
from racecar.sensors.findings import Finding

_BLOCKS = 10
"""Blocks of a recording; each counts by its least delay, because buses and disks only ever add to it."""
_MOST = 1000
"""Maximum number of samples kept. Chosen by judgement: enough for each block."""
_LEAST_DRIFT = 0.2
"""Minimum drift in seconds. Chosen by judgement: more than mapper and localizer tolerate."""
_LEAST_SIGMAS = 6.0
"""Required significance of the drift in deviations. Chosen by judgement: delays are not Gaussian."""
_LEAST_RATE = 1e-3
"""Seconds per second, since crystal clocks err by less than 1e-4: smaller rates have other causes."""


class ClockRate:
    """The stamps of one topic and the times at which they were recorded."""

    def __init__(self) -> None:
        self._sample = EvenSample[tuple[int, int]](_MOST)

    def add(self, stamp: int, recorded: int) -> None:
        """Add the next message; nanoseconds."""
        self._sample.add((stamp, recorded))

    def drift(self) -> tuple[float, float, float] | None:
        """Seconds that the stamps gain per second, its standard deviation, and the seconds over which it was
        measured; None if there are too few samples."""
        if len(self._sample.values) < 5 * _BLOCKS:
            return None
        stamps, recorded = np.array(self._sample.values, dtype=np.int64).T
        seconds = (recorded - recorded[0]) * 1e-9
        ahead = ((stamps - recorded) - (stamps[0] - recorded[0])) * 1e-9
        blocks = np.array_split(np.arange(len(seconds)), _BLOCKS)
        best = np.array([block[np.argmax(ahead[block])] for block in blocks])
        times, ahead = seconds[best] - seconds[best].mean(), ahead[best]
        spread = float((times**2).sum())
        if spread <= 0.0:
            return None
        rate = float((times * ahead).sum()) / spread
        left = ahead - ahead.mean() - rate * times
        sigma = float(np.sqrt((left**2).sum() / (_BLOCKS - 2) / spread))
        return rate, sigma, float(np.ptp(times))


def drift_finding(topic: str, rate: ClockRate, other_topic: str, other: ClockRate) -> list[Finding]:
    """The finding that one topic's clock clearly drifts from another's."""
    mine, others = rate.drift(), other.drift()
    if mine is None or others is None:
        return []
    apart, sigma, seconds = mine[0] - others[0], float(np.hypot(mine[1], others[1])), min(mine[2], others[2])
    if abs(apart) < max(_LEAST_RATE, _LEAST_SIGMAS * sigma) or abs(apart) * seconds < _LEAST_DRIFT:
        return []
    return [
        Finding(
            "clock_drifts",
            topic=topic,
            gains="gains" if apart > 0.0 else "loses",
            milliseconds=abs(apart) * 1e3,
            other=other_topic,
        )
    ]
