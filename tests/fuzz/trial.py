"""One action on one input, in a process of its own, and whether it kept the rule.

The rule for whatever a user may hand over: a result, or one sentence and exit code 2; within bounded memory
and time; never a traceback, a warning, a signal, or a stray line.
"""

import os
import re
import resource
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecar.pipelines.commands.terminal import prepare_terminal

MEMORY = 1 << 30
"""Bytes that an input may take beyond what the process has anyway."""


@dataclass(frozen=True)
class Outcome:
    """What an action did."""

    fault: str
    """How it broke the rule; empty where it kept it."""
    exit_code: int
    output: str


def run_trial(action: Callable[[], int], folder: Path, seconds: float) -> Outcome:
    """Run an action, which returns an exit code, in a fork of this process, in ``folder``.

    ``seconds`` of processor time are granted. What the action imports should have been imported before, so
    that this is not done each time.
    """
    output = folder / "output.txt"
    child = os.fork()
    if child == 0:
        _run_in_child(action, folder, output, seconds)
    _, status, usage = os.wait4(child, 0)
    printed = output.read_text(errors="replace") if output.exists() else ""
    output.unlink(missing_ok=True)
    code, used = os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime
    return Outcome(_broken_rule(code, printed, used, seconds), code, printed)


def _broken_rule(code: int, printed: str, used: float, seconds: float) -> str:
    if code < 0:
        return f"died of {signal.Signals(-code).name} after {used:.1f} s"
    if used > seconds:
        return f"took {used:.1f} s"
    if code == 0:
        return "printed although it was to be quiet" if printed else ""
    if code != 2:
        return f"exit code {code}"
    return "" if re.fullmatch(r"\S.*[.)]\n", printed) else "did not print one sentence"


def _warn_as_python_does() -> None:
    """Whatever the tests that this runs in make of warnings."""
    warnings.resetwarnings()
    for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", kind)
    warnings.showwarning = lambda message, kind, file, line, *_: print(
        f"{file}:{line}: {kind.__name__}: {message}", file=sys.stderr
    )


def _run_in_child(action: Callable[[], int], folder: Path, output: Path, seconds: float) -> None:
    """Never returns."""
    code = 1
    try:
        file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, 1)
        os.dup2(file, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        os.chdir(folder)
        prepare_terminal()
        _warn_as_python_does()
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.alarm(int(20 * seconds))  # a hang takes no processor time
        code = action()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
