"""Measures the progress of another thread while the localizer works."""

import time
from collections.abc import Callable
from threading import Event, Thread

import numpy as np
from numpy.typing import NDArray

from benchmarks.localizer.measured_drive import MeasuredDrive
from benchmarks.localizer.reference_kernels import spin

_TRIAL_TURNS = 10_000_000
"""Iterations for measuring the speed of the spin: a few milliseconds."""


class _Counter(Thread):
    """A Python loop that counts as fast as the interpreter allows."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.count = 0
        self._is_over = Event()

    def run(self) -> None:
        while not self._is_over.is_set():
            self.count += 1

    def stop(self) -> None:
        """Stop counting and wait for the thread."""
        self._is_over.set()
        self.join()

    def during(self, work: Callable[[], object]) -> NDArray[np.float64]:
        """(2,) counts during the work in this thread, and the seconds it takes."""
        count, started = self.count, time.perf_counter()
        work()
        return np.array([self.count - count, time.perf_counter() - started])


def pace_of_other_thread(
    drive: MeasuredDrive, rounds: int, steps: int, step_seconds: float
) -> tuple[float, float]:
    """The other thread's pace during steps, relative to its pace while this thread spins without Python.

    Also returns the milliseconds of a step. Both alternate; a spin takes as long as the steps of a round take
    alone.
    """
    turns = int(steps * step_seconds / _seconds_per_turn())
    spinning, stepping = np.zeros(2), np.zeros(2)
    counter = _Counter()
    counter.start()
    try:
        for _ in range(rounds):
            spinning += counter.during(lambda: spin(turns))
            stepping += counter.during(lambda: _feed(drive, steps))
    finally:
        counter.stop()
    pace, undisturbed = stepping[0] / stepping[1], spinning[0] / spinning[1]
    return float(pace / undisturbed), float(1e3 * stepping[1] / (rounds * steps))


def _feed(drive: MeasuredDrive, steps: int) -> None:
    for _ in range(steps):
        drive.next_step()
        drive.feed()


def _seconds_per_turn() -> float:
    spin(1)
    started = time.perf_counter()
    spin(_TRIAL_TURNS)
    return (time.perf_counter() - started) / _TRIAL_TURNS
