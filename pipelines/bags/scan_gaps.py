"""Gaps between the scans of a bag."""

import math
from collections import deque
from dataclasses import dataclass
from statistics import median

from racecar.sensors.findings import Finding
from racecar.sensors.scan import Scan

_LONG = 10.0
"""Seconds between scans from which a gap is reported; few recorders pause that long. Chosen by judgement."""
_NOTABLE = 1.0
"""Seconds from which a gap is reported if the car drove meanwhile. Chosen by judgement."""
_DRIVEN = 2.0
"""Metres driven within a gap from which scans before and after it may differ. Chosen by judgement."""
_TIMES_THE_USUAL = 5.0
"""Ratio to the usual spacing of scans, so scans that are rare throughout are not gaps."""
_USUAL_OF = 25
"""Scans that determine the usual spacing."""
_LISTED = 5
"""Most gaps listed, so the sentence stays readable."""


@dataclass(frozen=True)
class _Gap:
    seconds: float
    after: int
    """Number of scans before it."""
    metres: float
    """Metres by the wheels; 0 if there are none."""

    def __str__(self) -> str:
        driven = f", in which the wheels drove {self.metres:.1f} m" if self.metres >= _DRIVEN else ""
        return f"a gap of {self.seconds:.0f} s after scan {self.after}{driven}"


class ScanGaps:
    """Finds gaps as the scans of a bag are added; remembers where the first ones were."""

    def __init__(self) -> None:
        self.count = 0
        self._scans = 0
        self._last_stamp: int | None = None
        self._spacings: deque[float] = deque(maxlen=_USUAL_OF)
        self._last_path = 0.0
        self._was_driven = False
        self._listed: list[_Gap] = []

    def add(self, scan: Scan, path: float) -> None:
        """Add the next scan; ``path`` is the distance in metres by the wheels since the start."""
        seconds = 0.0 if self._last_stamp is None else (scan.stamp - self._last_stamp) * 1e-9
        metres = path - self._last_path
        if self._is_gap(seconds, metres):
            self.count += 1
            self._was_driven |= metres >= _DRIVEN
            if len(self._listed) < _LISTED:
                self._listed.append(_Gap(seconds, self._scans, metres))
        elif seconds > 0.0:
            self._spacings.append(seconds)
        self._scans += 1
        self._last_stamp, self._last_path = scan.stamp, path

    @property
    def findings(self) -> list[Finding]:
        """All gaps in one sentence, if there are any."""
        if not self._listed:
            return []
        return [
            Finding(
                "scan_gaps",
                gaps="; ".join(map(str, self._listed)),
                more=self.count - len(self._listed),
                was_driven=self._was_driven,
            )
        ]

    def _is_gap(self, seconds: float, metres: float) -> bool:
        if seconds > _LONG:
            return True
        usual = median(self._spacings) if self._spacings else math.inf
        return seconds > max(_NOTABLE, _TIMES_THE_USUAL * usual) and metres >= _DRIVEN
