"""What is wrong at the moment: logged once when it begins, and in the diagnostics while it lasts."""

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
"""For which an event stays in the diagnostics, long enough for a person to read it: by judgement."""
_LOGGED_EVERY = 0.2
"""Seconds between two lines of the log about the same fault, so that bad messages do not flood it."""


_PARAMETERS = {
    "--laser-pose X Y YAW": "the parameter laser_pose",
    "--laser-pose": "the parameter laser_pose",
    "with --no-imu": "by remapping imu",
}
"""By the words for flags, in this order."""
_LONGEST_WORD = 200
"""Characters of a name in a sentence: more than any frame or path that a person chose, by judgement."""


def with_short_words(sentence: str) -> str:
    """The sentence with the names in it cut that nobody can read."""
    return re.sub(rf"(\S{{{_LONGEST_WORD}}})\S+", r"\1…", sentence)


@dataclass
class _Fault:
    sentence: str
    until: float
    """On the monotonic clock; inf while nothing has ended it."""
    logged: float


class Faults:
    """The faults that last; may be reported from several threads at once."""

    def __init__(self, warn: Callable[[str], None], inform: Callable[[str], None]) -> None:
        self._warn, self._inform = warn, inform
        self._lock = Lock()
        self._active: dict[str, _Fault] = {}
        self._counts: dict[str, int] = {}

    def report(self, name: str, sentence: str, *, lasting: bool = True) -> None:
        """Something is wrong until it ends or, when not ``lasting``, for some seconds after its last report.

        It is logged once, and again only when the sentence changes or all was well in between.
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
        """The same of findings, under a ``key`` or the name of the first; what a flag gives offline, live a
        parameter does."""
        words = " ".join(finding.sentence for finding in findings)
        for flag, parameter in _PARAMETERS.items():
            words = words.replace(flag, parameter)
        self.report(key or findings[0].name, words, lasting=lasting)

    def judge(self, is_wrong: bool, finding: Finding, ended: str, key: str = "") -> None:
        """Report a finding as long as it holds, and with a sentence that it has ended."""
        if is_wrong:
            self.find(finding, key=key)
        else:
            self.end(key or finding.name, ended)

    def report_failure(self, error: Exception) -> None:
        """A callback or a piece of work has failed, and the node goes on; logged once for each place in the
        code where it did."""
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
        """All is well again, which is logged if it was not."""
        with self._lock:
            was_wrong = self._active.pop(name, None) is not None
        if was_wrong:
            self._inform(sentence)

    @property
    def sentences(self) -> list[str]:
        """All that is wrong now."""
        with self._lock:
            return [fault.sentence for fault in self._current().values()]

    @property
    def counts(self) -> dict[str, int]:
        """How often each began."""
        with self._lock:
            return dict(self._counts)

    def _current(self) -> dict[str, _Fault]:
        now = time.monotonic()
        self._active = {name: fault for name, fault in self._active.items() if fault.until > now}
        return self._active
