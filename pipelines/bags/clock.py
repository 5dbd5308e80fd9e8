"""Time stamps of messages, also where drivers leave them empty or let them jump."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

_LARGEST_JUMP = 3_600_000_000_000
"""Nanoseconds between the header's clock and the recorder's; a header further off is absurd: by judgement."""


def clock_offset(samples: Sequence[tuple[int, int]]) -> int | None:
    """Header time minus recording time, from pairs in nanoseconds; None where no header holds a time."""
    headers = {header for header, _ in samples}
    if not samples or (len(samples) > 1 and len(headers) == 1) or not any(headers):
        return None
    offsets = sorted(header - recorded for header, recorded in samples if header > 0)
    return offsets[len(offsets) // 2]


class StampClock:
    """The stamp of each message of a topic: its header's, or else the time it was recorded."""

    def __init__(self, offset: int, trust_headers: bool, counts: Counter[str]) -> None:
        """``offset`` in nanoseconds leads from the recorder's clock to that of the headers."""
        self._offset = offset
        self._trust_headers = trust_headers
        self._counts = counts

    def stamp(self, header: int, recorded: int) -> int:
        """Nanoseconds."""
        if self._trust_headers and header > 0 and abs(header - recorded - self._offset) < _LARGEST_JUMP:
            self._offset = header - recorded
            return header
        self._counts["stamps_from_recording_time"] += 1
        return recorded + self._offset


def typical_gap(stamps: Sequence[int]) -> float:
    """Seconds between neighbouring stamps, the median; inf where there are not two."""
    if len(stamps) < 2:
        return float("inf")
    return float(np.median(np.diff(np.sort(np.array(stamps, dtype=np.int64))))) * 1e-9
