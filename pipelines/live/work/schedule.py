"""Periodic work."""

import time


class Schedule:
    """Decides which work is due; all of it is at the start."""

    def __init__(self) -> None:
        self._due: dict[str, float] = {}

    def is_due(self, work: str, period: float) -> bool:
        """Whether work is due, once per ``period`` in seconds; if so it counts as done now."""
        now = time.monotonic()
        if now < self._due.get(work, 0.0):
            return False
        self._due[work] = now + period
        return True
