"""Work that is done again and again, each kind once in its period."""

import time


class Schedule:
    """Says when which work is due; all of it is at the start."""

    def __init__(self) -> None:
        self._due: dict[str, float] = {}

    def is_due(self, work: str, period: float) -> bool:
        """Whether it is time for a kind of work; then it is taken to be done now, and due in so many seconds
        again."""
        now = time.monotonic()
        if now < self._due.get(work, 0.0):
            return False
        self._due[work] = now + period
        return True
