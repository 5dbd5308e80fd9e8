"""Measures how long parts of a step take, and the ratios between them."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

_T = TypeVar("_T")


class Stopwatch:
    """Collects this thread's processor time by name.

    On an idle machine this equals the elapsed time; other work on the machine does not affect it.
    """

    def __init__(self) -> None:
        self._rounds: list[dict[str, list[float]]] = []
        self.begin_round()

    def begin_round(self) -> None:
        """Start a round; later measurements are not compared with earlier ones."""
        self._rounds.append({})

    def time(self, name: str, work: Callable[[], _T]) -> _T:
        """Time a single run of the work."""
        started = time.thread_time()
        result = work()
        self._rounds[-1].setdefault(name, []).append(time.thread_time() - started)
        return result

    def time_warm(self, name: str, work: Callable[[], object], repetitions: int) -> None:
        """Time repeated runs after a first one, which finds the caches as other work left them."""
        work()
        for _ in range(repetitions):
            self.time(name, work)

    def milliseconds(self, name: str) -> float:
        """Median in milliseconds."""
        return 1e3 * float(np.median([each for timed in self._rounds for each in timed.get(name, [])]))

    def ratio(self, name: str, to: str) -> float:
        """Median ratio over the rounds, which does not depend on the processor's speed in each."""
        rounds = [timed for timed in self._rounds if name in timed and to in timed]
        return float(np.median([np.median(timed[name]) / np.median(timed[to]) for timed in rounds]))
