"""The speedup of two threads from a second core."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import nan

import numpy as np


@dataclass(frozen=True)
class SecondCore:
    """Medians over repetitions."""

    seconds: float
    """Wall time with the second core."""
    gain: float
    """Ratio of the time on one core to that; NaN if a process cannot be pinned to one core (macOS), or the
    machine has no other."""


def time_second_core(work: Callable[[], object], repetitions: int) -> SecondCore:
    """Repeat the work, alternating between one and two cores."""
    with_it, without = [], []
    for _ in range(repetitions):
        with_it.append(_seconds(work))
        with _on_one_core() as is_one:
            without.append(_seconds(work) if is_one else nan)
    gains = np.array(without) / np.array(with_it)
    return SecondCore(float(np.median(with_it)), float(np.median(gains)))


def _seconds(work: Callable[[], object]) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


@contextmanager
def _on_one_core() -> Iterator[bool]:
    """Pins threads started within the block to one core; yields whether that is possible."""
    if not hasattr(os, "sched_setaffinity") or len(cores := os.sched_getaffinity(0)) < 2:
        yield False
        return
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield True
    finally:
        os.sched_setaffinity(0, cores)
