"""Time axis for plots of a recording, without the pauses in which nothing was recorded."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

_SHORTEST_PAUSE = 10.0
"""Seconds; shorter pauses save too little space. Chosen by judgement."""
_TIMES_THE_USUAL = 10.0
"""Ratio to the usual step between scans, so a recording of rare scans is not all pauses."""
_LINE_COLOR = "#9aa3ad"


class DrivenTime:
    """Seconds of a recording minus the pauses before them."""

    def __init__(self, *seconds: NDArray[np.float64]) -> None:
        """``seconds`` are the scan times (N,) of one recording, or of several that are plotted together."""
        times = np.unique(np.concatenate([*seconds, [0.0]]))
        gaps = np.diff(times)
        usual = float(np.median(gaps)) if len(gaps) else 0.0
        self._is_pause = gaps > max(_SHORTEST_PAUSE, _TIMES_THE_USUAL * usual)
        self._times = times
        self._shown = np.append(0.0, np.cumsum(np.where(self._is_pause, 0.0, gaps)))
        self._paused = float(gaps[self._is_pause].sum())

    def of(self, seconds: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions (M,) on the axis for times (M,) of the recording."""
        places: NDArray[np.float64] = np.interp(seconds, self._times, self._shown)
        return places

    def line(
        self, seconds: NDArray[np.float64], values: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Values (M,) at times (M,) to draw: both with a nan at each pause, which no line crosses."""
        starts = self._times[1:][self._is_pause]
        pauses = np.searchsorted(seconds, starts)
        return np.insert(self.of(seconds), pauses, np.nan), np.insert(values, pauses, np.nan)

    def mark(self, *axes: Axes) -> None:
        """Draw the pauses, and label the time axis of the last axes."""
        places = self._shown[1:][self._is_pause]
        for each in axes:
            for place in places:
                each.axvline(place, color=_LINE_COLOR, linestyle=":", linewidth=0.8, zorder=0)
        axes[-1].set_xlabel(f"time (s){self._left_out(len(places))}")

    def _left_out(self, count: int) -> str:
        if not count:
            return ""
        length = f"{self._paused:.0f} s" if self._paused < 120 else f"{self._paused / 60:.0f} min"
        return (
            f", without a pause of {length}" if count == 1 else f", without {count} pauses of {length} in all"
        )
