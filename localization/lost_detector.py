"""Is the car where the filter thinks?"""

_POOR_FIT = -5.0
_LOST_AFTER = 20
"""Scans."""


class LostDetector:
    """Counts scans that do not fit, whatever the pose; the fit is a beam's mean log-probability."""

    def __init__(self) -> None:
        self._poor_scans = 0

    @property
    def probability(self) -> float:
        """How likely the car is elsewhere, 0 to 1."""
        return min(self._poor_scans / _LOST_AFTER, 1.0)

    def judge(self, fit: float) -> None:
        """Take in how well the best particle explains a scan."""
        self._poor_scans = self._poor_scans + 1 if fit < _POOR_FIT else 0
