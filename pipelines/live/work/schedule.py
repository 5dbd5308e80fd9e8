"""Work that is done again and again, each kind once in its period."""

import time
from collections.abc import Mapping


class Schedule:
    """Says when which work is due; all of it is at the start."""

    def __init__(self, periods: Mapping[str, float]) -> None:
        """``periods``: seconds, by kind of work."""
        self._periods = periods
        self._due = dict.fromkeys(periods, 0.0)

    def is_due(self, work: str) -> bool:
        """Whether it is time for a kind of work; then it is taken to be done now."""
        now = time.monotonic()
        if now < self._due[work]:
            return False
        self._due[work] = now + self._periods[work]
        return True
