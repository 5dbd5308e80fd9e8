"""Gaps between the scans of a bag."""

from racecar.maps.sensing.scan import Scan
from racecar.pipelines.bags.findings import Finding

GAP_SECONDS = 10.0
"""Between two scans; more is worth reporting, since few recorders pause for that long: by judgement."""
_LISTED = 5
"""So that the sentence stays readable."""


class ScanGaps:
    """Takes note of the scans of a bag as they come; remembers where the first gaps were."""

    def __init__(self) -> None:
        self.count = 0
        self._scans = 0
        self._last_stamp: int | None = None
        self._listed: list[str] = []

    def add(self, scan: Scan) -> None:
        """Take note of the next scan."""
        seconds = 0.0 if self._last_stamp is None else (scan.stamp - self._last_stamp) * 1e-9
        if seconds > GAP_SECONDS:
            self.count += 1
            if len(self._listed) < _LISTED:
                self._listed.append(f"a gap of {seconds:.0f} s after scan {self._scans}")
        self._scans += 1
        self._last_stamp = scan.stamp

    @property
    def findings(self) -> list[Finding]:
        """All gaps in one sentence, if there are any."""
        if not self._listed:
            return []
        more = self.count - len(self._listed)
        what = f"There is {', '.join(self._listed)}{f' and {more} more' if more else ''}."
        return [
            Finding(
                what,
                "No action is needed if the car stood still meanwhile; otherwise look whether the map breaks "
                "there, and find out what stopped the laser or the recorder.",
            )
        ]
