"""Where the recorder's clock was set back while it recorded.

A recorder appends messages as they arrive, so their order in the file shows it. Files that were written topic
by topic go back in time as well, but no topic does.
"""

from collections.abc import Sequence
from itertools import pairwise
from statistics import median

import numpy as np

LATEST = 1 << 62
"""Nanoseconds since 1970, in the year 2116; later times are damaged. Two of them add up within 64 bits."""
SET_BACK = 1_000_000_000
"""Nanoseconds; recorders write messages out of order by less."""
MOST_SET_BACK = 20
"""Places of a file where time goes back that are looked at, so that opening it takes seconds even where the
times are in disorder throughout. Chosen by judgement."""
_AROUND = 50
"""Messages before and after, among which time must run evenly: a few damaged times are no clock."""
_FEWEST = 3
"""Messages that show the time before or after."""


def set_backs(moments: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Where the clock was set back: the index of the first message after it, and the step in nanoseconds.

    ``moments`` are channel and time of messages, in the order of the file.
    """
    times = np.array([min(max(time, 0), LATEST) for _, time in moments], dtype=np.int64)
    found = []
    for index in (np.flatnonzero(np.diff(times) < -SET_BACK) + 1).tolist():
        before, after = slice(max(index - _AROUND, 0), index), slice(index, index + _AROUND)
        back = int(times[before].max() - times[after].min())
        steps = [np.diff(times[part]) for part in (before, after)]
        runs_evenly = all(
            len(each) + 1 >= _FEWEST and each.min() > -SET_BACK and each.max() < back / 2 for each in steps
        )
        last, first = dict(moments[before]), dict(reversed(moments[after]))
        shared = last.keys() & first.keys()
        if runs_evenly and shared and all(first[channel] < last[channel] for channel in shared):
            usual = [
                last[channel] + _spacing(moments[before], channel) - first[channel] for channel in shared
            ]
            found.append((index, max(back, round(median(usual)))))
    return found


def _spacing(moments: Sequence[tuple[int, int]], channel: int) -> float:
    """Nanoseconds between the messages of a channel."""
    times = [time for each, time in moments if each == channel]
    return median(after - time for time, after in pairwise(times)) if len(times) > 1 else 0.0
