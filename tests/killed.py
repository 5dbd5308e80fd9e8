"""Work that is killed, at the calls by which files come, go and reach the disk, or at any moment."""

import os
import signal
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Any

CALLS = ("fsync", "mkdir", "rename", "replace", "rmdir", "unlink")
"""Of the module ``os``, which pathlib and shutil call, too."""

_PATIENCE = 20
"""Tenths of a second; where nobody asks how an orphan ended, it seems to be there for ever."""


def killed_at(call: int, work: Callable[[], object]) -> bool:
    """Do some work in a fork that is killed, with all processes that it has started, as it comes to one of
    those calls, counted from 0; False when it ended before."""
    return _is_killed(_fork(lambda: _until(call, work)))


def killed_after(seconds: float, work: Callable[[], object]) -> bool:
    """The same at a moment."""
    child = _fork(work)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    return _is_killed(child)


def in_fork(work: Callable[[], object]) -> None:
    """Do some work in a fork, to its end."""
    assert not _is_killed(_fork(work))


def calls_of(work: Callable[[], object]) -> int:
    """To how many of those calls some work comes; it is done in a fork."""
    reading, writing = os.pipe()

    def tell() -> None:
        calls = _until(-1, work)
        os.write(writing, str(next(calls)).encode())

    assert not _is_killed(_fork(tell))
    os.close(writing)
    with os.fdopen(reading) as told:
        return int(told.read())


def _fork(work: Callable[[], object]) -> int:
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.setpgid(0, 0)
            work()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.setpgid(child, child)  # whoever of the two comes first
    return child


def _is_killed(child: int) -> bool:
    """Raises AssertionError when the work went wrong."""
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    with suppress(ProcessLookupError):
        for _ in range(_PATIENCE):  # what they were doing in the kernel, they do to its end
            os.killpg(child, signal.SIGKILL)
            time.sleep(0.1)
    assert code in (0, -signal.SIGKILL), f"the work ended with code {code}"
    return code != 0


def _until(call: int, work: Callable[[], object]) -> "count[int]":
    """Do some work, up to a call of this number; the counter of calls."""
    calls = count()

    def mortal(function: Callable[..., object]) -> Callable[..., object]:
        def call_or_die(*arguments: Any, **options: Any) -> object:
            if next(calls) == call:
                os.kill(os.getpid(), signal.SIGKILL)
            return function(*arguments, **options)

        return call_or_die

    for name in CALLS:
        setattr(os, name, mortal(getattr(os, name)))
    work()
    return calls
