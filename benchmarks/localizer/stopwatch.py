"""Measuring how long parts of a step take, and how much longer one is than another."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

_T = TypeVar("_T")


class Stopwatch:
    """Gathers how much processor time this thread took for things, by name.

    On a machine with nothing else to do it is how long they took; other work there does not show.
    """

    def __init__(self) -> None:
        self._rounds: list[dict[str, list[float]]] = []
        self.begin_round()

    def begin_round(self) -> None:
        """What is timed from here on is compared with nothing before it."""
        self._rounds.append({})

    def time(self, name: str, work: Callable[[], _T]) -> _T:
        """Do the work once."""
        started = time.thread_time()
        result = work()
        self._rounds[-1].setdefault(name, []).append(time.thread_time() - started)
        return result

    def time_warm(self, name: str, work: Callable[[], object], repetitions: int) -> None:
        """Do it repeatedly after a first time, which finds the caches as other work left them."""
        work()
        for _ in range(repetitions):
            self.time(name, work)

    def milliseconds(self, name: str) -> float:
        """The median."""
        return 1e3 * float(np.median([each for timed in self._rounds for each in timed.get(name, [])]))

    def ratio(self, name: str, to: str) -> float:
        """The median over the rounds, so that it does not matter how fast the processor was in which."""
        rounds = [timed for timed in self._rounds if name in timed and to in timed]
        return float(np.median([np.median(timed[name]) / np.median(timed[to]) for timed in rounds]))
