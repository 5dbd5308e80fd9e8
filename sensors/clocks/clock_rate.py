"""Whether clocks run at different rates, by how their stamps gain on the times of recording."""

import numpy as np

from racecar.sensors.even_sample import EvenSample
from racecar.sensors.findings import Finding

_BLOCKS = 10
"""Of a recording, of each of which the least delay counts, because buses and disks only ever add to it."""
_MOST = 1000
"""Samples that are kept: by judgement, so many for each block."""
_LEAST_DRIFT = 0.2
"""Seconds by which two clocks must have drifted apart: mapper and localizer bear less; by judgement."""
_LEAST_SIGMAS = 6.0
"""Standard deviations by which the drift must show: by judgement, as delays do not scatter like noise."""
_LEAST_RATE = 1e-3
"""Seconds a second: crystals of clocks are wrong by less than 1e-4, so that less has other causes."""


class ClockRate:
    """The stamps of one topic beside the times at which they were recorded."""

    def __init__(self) -> None:
        self._sample = EvenSample[tuple[int, int]](_MOST)

    def add(self, stamp: int, recorded: int) -> None:
        """Take note of the next message; nanoseconds."""
        self._sample.add((stamp, recorded))

    def drift(self) -> tuple[float, float, float] | None:
        """Seconds that the stamps gain in a second, the standard deviation of that, and over how many seconds
        it was seen; None where there are too few samples."""
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
    """That the clock of a topic surely drifts away from that of another one."""
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
