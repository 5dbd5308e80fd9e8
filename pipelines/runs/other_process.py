"""Work in other processes: a fresh one, whose memory and state are its own, or a copy of this one."""

import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

_T = TypeVar("_T")


def in_fresh_process(work: Callable[[], _T]) -> _T:
    """Call a picklable function in a new interpreter and wait for it; what it raises is raised here.

    The process does not outlive the call, Ctrl-C included. Raises RuntimeError when it dies without a word.
    """
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_deliver, args=(work, sender))
    with _deaf_to_interrupts():
        process.start()
    sender.close()
    try:
        value, error, trace = receiver.recv()
    except EOFError:
        process.join()
        raise RuntimeError(f"the process of a run ended with code {process.exitcode}") from None
    except BaseException:
        process.kill()
        raise
    finally:
        process.join()
        receiver.close()
    if error is not None:
        raise error from RuntimeError(trace)
    result: _T = value
    return result


def start_beside(work: Callable[[], None]) -> None:
    """Call a function in a copy of this process, and do not wait: what it does is left on disk.

    Call this before threads are started. The copy does not outlive this process, and never hears Ctrl-C.
    """
    with _deaf_to_interrupts():
        get_context("fork").Process(target=work, daemon=True).start()


def _deliver(work: Callable[[], Any], sender: Connection) -> None:
    try:
        sender.send((work(), None, ""))
    except Exception as error:
        sender.send((None, error, traceback.format_exc()))


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """A process started meanwhile never hears Ctrl-C, which a terminal sends to it too: we end it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
