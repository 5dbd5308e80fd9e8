"""Run work in other processes: a fresh one with its own memory and state, or a forked copy of this one."""

import logging
import os
import signal
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import current_process, get_context, parent_process
from multiprocessing.connection import Connection
from threading import Lock, Thread
from typing import Any, Generic, TypeVar

_T = TypeVar("_T")

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The variables that set a library's number of threads before it is loaded."""
_LEAST_URGENT = 19
"""The lowest priority of a process, by definition of nice(2)."""
_environment = Lock()


class ProcessDiedError(RuntimeError):
    """A process ended without a result, for example because it was killed."""

    def __init__(self, exit_code: int) -> None:
        """A negative ``exit_code`` is minus the number of a signal."""
        super().__init__(f"the process of a run ended with code {exit_code}")
        self.exit_code = exit_code


class FreshProcess(Generic[_T]):
    """Calls a picklable function in a new interpreter, in parallel with this one.

    The process ignores Ctrl-C, which a terminal sends to it too. It does not outlive this process, even when
    that is killed.
    """

    def __init__(self, work: Callable[[], _T], *, threads: int | None = None, is_urgent: bool = True) -> None:
        """Start the process with this many ``threads``; None leaves it to its libraries. A process that is
        not urgent uses only idle processor time."""
        context = get_context("spawn")
        self._receiver, sender = context.Pipe(duplex=False)
        self._process = context.Process(target=_deliver, args=(work, sender, is_urgent), daemon=True)
        if current_process().daemon:  # dask workers may have no children that could outlive them; ours cannot
            current_process().daemon = False
        with _deaf_to_interrupts(), _limited(threads):
            self._process.start()
        sender.close()

    @property
    def is_over(self) -> bool:
        """Whether `result` returns without waiting."""
        return self._receiver.poll()

    def ask_to_stop(self) -> None:
        """Send SIGTERM, which ends the process unless it handles the signal."""
        self._process.terminate()

    def result(self) -> _T:
        """Wait for the function and return its value, or raise its exception. Call this only once.

        Ctrl-C meanwhile kills the process. Raises ProcessDiedError when it dies without a result.
        """
        try:
            value, error, trace = self._receiver.recv()
        except EOFError:
            self._process.join()
            raise ProcessDiedError(self._process.exitcode or 0) from None
        except BaseException:
            self._process.kill()
            raise
        finally:
            self._process.join()
            self._receiver.close()
        if error is not None:
            raise error from RuntimeError(trace)
        result: _T = value
        return result

    def kill(self) -> None:
        """Kill the process at once; there is no result."""
        self._process.kill()
        self._process.join()
        self._receiver.close()


def in_fresh_process(work: Callable[[], _T], *, threads: int | None = None, is_urgent: bool = True) -> _T:
    """Call a function in a `FreshProcess`, and wait for its result."""
    return FreshProcess(work, threads=threads, is_urgent=is_urgent).result()


def start_beside(work: Callable[[], None]) -> None:
    """Call a function in a forked copy of this process without waiting; its results stay on disk.

    Call this before threads are started. The copy does not outlive this process, and ignores Ctrl-C.
    """
    with _deaf_to_interrupts():
        get_context("fork").Process(target=work, daemon=True).start()


def leave_terminal_alone() -> None:
    """Print only errors from this process; the report has everything else that a user should know."""
    logging.getLogger("racecar").setLevel(logging.ERROR)
    warnings.simplefilter("ignore")


def _deliver(work: Callable[[], Any], sender: Connection, is_urgent: bool) -> None:
    if not is_urgent:
        os.nice(_LEAST_URGENT)
    Thread(target=_end_with_parent, daemon=True).start()
    try:
        sender.send((work(), None, ""))
    except Exception as error:
        sender.send((None, error, traceback.format_exc()))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _limited(threads: int | None) -> Iterator[None]:
    """Limit processes started during the block to this many threads."""
    if threads is None:
        yield
        return
    with _environment:
        before = {name: os.environ.get(name) for name in _THREADS}
        os.environ.update(dict.fromkeys(_THREADS, str(threads)))
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes started during the block ignore Ctrl-C, which terminals send to them too: we end them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
