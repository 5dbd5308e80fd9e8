"""Ctrl-C that asks work to stop at a suitable point instead of aborting it anywhere."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, a request to terminate, and a terminal that is closed."""


def end_like_ctrl_c() -> None:
    """Have every request to end raise KeyboardInterrupt from now on, so that unfinished work is cleaned up.

    A forked copy of this process still ends at once. Under nohup, a closed terminal is still survived.
    """
    others = [number for number in STOP_SIGNALS if number != signal.SIGINT and not is_to_be_survived(number)]
    for number in others:
        signal.signal(number, signal.default_int_handler)

    def wait() -> None:  # while the copy is forked, a signal meant for it would reach our handler and be lost
        signal.pthread_sigmask(signal.SIG_BLOCK, others)

    def hear_again() -> None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, others)

    def end_at_once() -> None:
        for number in others:
            signal.signal(number, signal.SIG_DFL)
        hear_again()

    os.register_at_fork(before=wait, after_in_parent=hear_again, after_in_child=end_at_once)


def is_to_be_survived(number: signal.Signals) -> bool:
    """Whether whoever started the process wants it to live on: a closed terminal, under nohup."""
    return number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN


class StopRequest:
    """Whether Ctrl-C or another process asks the work to stop.

    It raises KeyboardInterrupt unless the work polls for it. A request is remembered, because Python drops a
    KeyboardInterrupt raised in a destructor, as between two kernels' compilations.
    """

    def __init__(self) -> None:
        self.is_made = False
        self.source = ""
        """Where the request came from."""
        self.has_torn = False
        """Whether it raised KeyboardInterrupt, even if that was dropped."""
        self._is_looked_for = False

    @contextmanager
    def looked_for(self) -> Iterator[None]:
        """Only remember a request during the block; a second Ctrl-C raises KeyboardInterrupt."""
        before, self._is_looked_for = self._is_looked_for, True
        try:
            yield
        finally:
            self._is_looked_for = before

    def take(self, number: int, _frame: FrameType | None) -> None:
        """Handle a signal."""
        is_second = self.is_made and number == signal.SIGINT
        self.is_made = True
        self.source = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
        if is_second or not self._is_looked_for:
            self.has_torn = True
            raise KeyboardInterrupt


@contextmanager
def stop_request(*signals: signal.Signals) -> Iterator[StopRequest]:
    """Yield, for the duration of the block, whether any of the signals requests a stop.

    Also raises KeyboardInterrupt if Python dropped it and the block failed because of what it interrupted.
    """
    request = StopRequest()
    heard = [number for number in signals if not is_to_be_survived(number)]
    before = {number: signal.signal(number, request.take) for number in heard}
    try:
        yield request
    except Exception as error:
        if request.has_torn:
            raise KeyboardInterrupt from error
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
