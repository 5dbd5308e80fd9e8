"""Statistics of the returns removed as fixed to the robot."""

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.scan import Scan

_SECTORS = 72
"""Sectors of 5°, so that a reported sector is easy to find on the robot."""
_MOST = 0.1
"""Share of the fullest sector below which a sector is not reported, because it holds only the edges of fixed
objects; chosen by judgement."""
_FEW = 0.01
"""Share of a scan's returns removed by chance, so that such scans do not extend the reported time; chosen by
judgement."""
_EDGE = 0.02
"""Quantile used as nearest and farthest return, so that outliers do not matter."""
_STEPS = 0.05
"""Metres per histogram bin: fine enough, because reports round to a tenth."""
_FARTHEST = 400
"""Number of bins, 20 m. Chosen by judgement: fixed objects are nearer."""


@dataclass(frozen=True)
class Sector:
    """A sector of the laser's view."""

    begin: float
    end: float
    """Degrees, counter-clockwise from straight ahead."""
    nearest: float
    farthest: float
    """Metres."""


class LeftOut:
    """Count removed returns."""

    def __init__(self) -> None:
        self.returns = 0
        self.scans = 0
        self._of = 0
        self._first: int | None = None
        self._stamps: tuple[int, int] | None = None
        self._counts = np.zeros((_SECTORS, _FARTHEST), dtype=np.int64)

    def begin(self, stamp: int) -> None:
        """Start the clock at the first stamp (nanoseconds); later calls have no effect."""
        self._first = stamp if self._first is None else self._first

    def add(self, scan: Scan, mask: NDArray[np.bool_]) -> None:
        """Add a judged scan and the mask (N,) of its removed beams."""
        self._of += int(np.count_nonzero(scan.is_return))
        if not mask.any():
            return
        left_out = int(np.count_nonzero(mask))
        if left_out > _FEW * np.count_nonzero(scan.is_return):
            self._stamps = (scan.stamp if self._stamps is None else self._stamps[0], scan.stamp)
        self.scans += 1
        self.returns += left_out
        sectors = np.floor(scan.bearings[mask] / (2.0 * np.pi) * _SECTORS).astype(np.int64) % _SECTORS
        steps = np.minimum(scan.ranges[mask] / _STEPS, _FARTHEST - 1).astype(np.int64)
        np.add.at(self._counts, (sectors, steps), 1)

    @property
    def share(self) -> float:
        """Removed share of all returns in judged scans."""
        return self.returns / max(self._of, 1)

    @property
    def seconds(self) -> tuple[float, float]:
        """Seconds from the first scan to the first and the last one that lost more than a few returns."""
        if self._first is None or self._stamps is None:
            return 0.0, 0.0
        begin, end = self._stamps
        return (begin - self._first) * 1e-9, (end - self._first) * 1e-9

    @property
    def sectors(self) -> list[Sector]:
        """Sectors with removed returns, neighbours merged, counter-clockwise starting behind the laser."""
        counts = np.roll(self._counts, _SECTORS // 2, axis=0)
        per_sector = counts.sum(axis=1)
        chosen = per_sector > _MOST * per_sector.max()
        edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False)).reshape(-1, 2)
        return [_sector(begin, end, counts[begin:end].sum(axis=0)) for begin, end in edges.tolist()]

    def as_dict(self) -> dict[str, object]:
        """The summary in report.json."""
        begin, end = self.seconds
        return {
            "returns": self.returns,
            "share": self.share,
            "scans": self.scans,
            "begin_s": begin,
            "end_s": end,
            "sectors": [asdict(sector) for sector in self.sectors],
        }


def _sector(begin: int, end: int, counts: NDArray[np.int64]) -> Sector:
    shares = np.cumsum(counts) / counts.sum()
    nearest, farthest = np.searchsorted(shares, [_EDGE, 1.0 - _EDGE])
    begin_degrees, end_degrees = (360.0 / _SECTORS * (k - _SECTORS // 2) for k in (begin, end))
    return Sector(begin_degrees, end_degrees, float(nearest * _STEPS), float((farthest + 1) * _STEPS))
