"""Recent rates, and the latency from a scan's arrival to its pose."""

import time
from collections import deque
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

_WINDOW = 400
"""Messages for rates and latencies, 10 s of scans at 40 Hz. Chosen by judgement."""
_MOST_LATENCIES = 200_000
"""Latencies for percentiles over the run: over an hour at 40 Hz, to bound the memory."""


class Health:
    """Counts and times events; thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._arrivals: dict[str, deque[float]] = {}
        self._latencies = np.zeros(_MOST_LATENCIES, dtype=np.float32)
        self._noted = 0
        self._began: tuple[float, float] | None = None
        self._counts: dict[str, int] = {}

    def note(self, what: str) -> None:
        """Record an event."""
        with self._lock:
            self._arrivals.setdefault(what, deque(maxlen=_WINDOW)).append(time.monotonic())
            self._counts[what] = self._counts.get(what, 0) + 1

    def note_latency(self, seconds: float) -> None:
        """Record the seconds from a scan's arrival to its pose."""
        with self._lock:
            if self._began is None:
                self._began = time.monotonic(), time.process_time()
            self._latencies[self._noted % _MOST_LATENCIES] = seconds
            self._noted += 1

    def rate(self, what: str) -> float:
        """Per second, over the last five seconds."""
        now = time.monotonic()
        with self._lock:
            recent = [arrival for arrival in self._arrivals.get(what, ()) if now - arrival < 5.0]
        if len(recent) < 2:
            return 0.0
        return (len(recent) - 1) / max(now - recent[0], 1e-3)

    def silence(self, what: str) -> float:
        """Seconds since the last event; inf if there was none."""
        with self._lock:
            arrivals = self._arrivals.get(what)
            return time.monotonic() - arrivals[-1] if arrivals else float("inf")

    def count(self, what: str) -> int:
        """Number of events so far."""
        with self._lock:
            return self._counts.get(what, 0)

    def latency_ms(self) -> dict[str, float]:
        """Median and 99th percentile of the last few hundred scans."""
        with self._lock:
            return _percentiles(self._last_latencies(_WINDOW))

    def summary(self) -> dict[str, Any]:
        """Figures of the whole run: counts; latency, also as medians over each tenth of the scans; and the
        share of a core used since the first pose."""
        with self._lock:
            latencies = self._last_latencies(_MOST_LATENCIES)
            began, counts = self._began, dict(self._counts)
        wall, cpu = (time.monotonic() - began[0], time.process_time() - began[1]) if began else (0.0, 0.0)
        return {
            "counts": counts,
            "latency_ms": _percentiles(latencies),
            "latency_ms_by_tenth": [
                float(np.median(tenth)) * 1e3 for tenth in np.array_split(latencies, 10) if len(tenth)
            ],
            "cpu_share": cpu / wall if wall else 0.0,
            "seconds": wall,
        }

    def _last_latencies(self, most: int) -> NDArray[np.float32]:
        """(N,) seconds of the last ``most`` scans."""
        scans = np.arange(max(self._noted - most, 0), self._noted)
        return self._latencies[scans % _MOST_LATENCIES]


def _percentiles(latencies: NDArray[np.float32]) -> dict[str, float]:
    if len(latencies) == 0:
        return {}
    median, high, most = np.quantile(latencies, [0.5, 0.99, 1.0]) * 1e3
    return {"median": float(median), "percentile_99": float(high), "longest": float(most)}
