"""Judge the map while it grows, for the diagnostics."""

import time
from collections.abc import Callable
from typing import Any

from racecar.mapping.quality.map_quality import MapQuality
from racecar.pipelines.live.work.worker import Worker

_EVERY = 60.0
"""Seconds between verdicts. Chosen by judgement, since a few more metres hardly improve a map."""
_LEAST_REST = 100.0
"""Minimum pause per judging time, which grows with the map: 1 % of a core, because mapping comes first."""


class MapVerdict:
    """Judges the map periodically."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self._due = time.monotonic() + _EVERY
        self.quality: MapQuality | None = None
        """The last verdict; None before the first."""

    @property
    def figures(self) -> dict[str, Any]:
        """The last verdict, with the first reason if the map is not good; empty before the first."""
        quality = self.quality
        if quality is None:
            return {}
        return {
            "map so far": quality.verdict.value,
            "expected error (m per 10 m)": quality.error_per_10_m,
            "expected error (m over all)": quality.error_of_whole,
            "doubt": next(iter(quality.reasons), "none"),
        }

    def judge_when_due(self, quality: Callable[[], Callable[[], MapQuality]]) -> None:
        """If due, let the worker judge the current map; ``quality`` takes a snapshot of it."""
        if time.monotonic() < self._due:
            return
        self._due = float("inf")
        judge = quality()
        self._worker.put("verdict", lambda: self._judge(judge))

    def _judge(self, judge: Callable[[], MapQuality]) -> None:
        began = time.monotonic()
        try:
            self.quality = judge()
        finally:
            now = time.monotonic()
            self._due = now + max(_EVERY, _LEAST_REST * (now - began))
