"""Current faults: logged once when they begin, and in the diagnostics while they last."""

import logging
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from traceback import extract_tb

from racecar.sensors.findings import Finding

_log = logging.getLogger(__name__)

EVENT_SECONDS = 5.0
"""Seconds for which an event stays in the diagnostics. Chosen by judgement: long enough to read it."""
_LOGGED_EVERY = 0.2
"""Seconds between two log lines about the same fault, so that bad messages do not flood the log."""
_LONGEST_WORD = 200
"""Characters of a name in a sentence. Chosen by judgement: more than any frame or path chosen by a person."""


def with_short_words(sentence: str) -> str:
    """The sentence with overlong names truncated."""
    return re.sub(rf"(\S{{{_LONGEST_WORD}}})\S+", r"\1…", sentence)


@dataclass
class _Fault:
    sentence: str
    until: float
    """On the monotonic clock; inf until something ends it."""
    logged: float


class Faults:
    """The current faults; thread-safe."""

    def __init__(self, warn: Callable[[str], None], inform: Callable[[str], None]) -> None:
        self._warn, self._inform = warn, inform
        self._lock = Lock()
        self._active: dict[str, _Fault] = {}
        self._counts: dict[str, int] = {}

    def report(self, name: str, sentence: str, *, lasting: bool = True) -> None:
        """Report a fault until it ends or, if not ``lasting``, for some seconds after its last report.

        It is logged once, and again only if the sentence changes or the fault had ended in between.
        """
        now, sentence = time.monotonic(), with_short_words(sentence)
        with self._lock:
            before = self._current().get(name)
            is_new = before is None or (before.sentence != sentence and now - before.logged > _LOGGED_EVERY)
            logged = now if is_new or before is None else before.logged
            until = float("inf") if lasting else now + EVENT_SECONDS
            self._active[name] = _Fault(sentence, until, logged)
            if is_new:
                self._counts[name] = self._counts.get(name, 0) + 1
        if is_new:
            self._warn(sentence)

    def find(self, *findings: Finding, key: str = "", lasting: bool = True) -> None:
        """Report findings, under a ``key`` or the name of the first."""
        words = " ".join(finding.sentence for finding in findings)
        self.report(key or findings[0].name, words, lasting=lasting)

    def judge(self, is_wrong: bool, finding: Finding, ended: str, key: str = "") -> None:
        """Report a finding while it holds, and log a sentence when it ends."""
        if is_wrong:
            self.find(finding, key=key)
        else:
            self.end(key or finding.name, ended)

    def report_failure(self, error: Exception) -> None:
        """Report an exception in a callback or a piece of work, after which the node continues; logged once
        per place in the code."""
        origin = extract_tb(error.__traceback__)[-1:]
        name = " ".join(["internal", *(f"{Path(frame.filename).name}:{frame.lineno}" for frame in origin)])
        with self._lock:
            is_known = name in self._counts
            self._counts[name] = self._counts.get(name, 0) + 1
            words = with_short_words(f"{type(error).__name__}: {error}")
            sentence = f"A fault in racecar, not yours ({words}); please report it."
            self._active[name] = _Fault(sentence, time.monotonic() + EVENT_SECONDS, time.monotonic())
        if not is_known:
            self._warn(sentence)
            _log.error("What failed", exc_info=error)

    def end(self, name: str, sentence: str) -> None:
        """End a fault, which is logged if it was reported."""
        with self._lock:
            was_wrong = self._active.pop(name, None) is not None
        if was_wrong:
            self._inform(sentence)

    @property
    def sentences(self) -> list[str]:
        """All current faults."""
        with self._lock:
            return [fault.sentence for fault in self._current().values()]

    @property
    def counts(self) -> dict[str, int]:
        """Number of times each began."""
        with self._lock:
            return dict(self._counts)

    def _current(self) -> dict[str, _Fault]:
        now = time.monotonic()
        self._active = {name: fault for name, fault in self._active.items() if fault.until > now}
        return self._active
