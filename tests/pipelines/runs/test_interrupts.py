import signal

import pytest

from racecar.pipelines.runs.interrupts import stop_request


def test_first_interrupt_asks_and_second_tears() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), stop_request(signal.SIGINT) as stop, stop.looked_for():
        assert not stop.is_made
        signal.raise_signal(signal.SIGINT)
        assert stop.is_made
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_request_to_end_may_come_twice() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with stop_request(signal.SIGINT, signal.SIGTERM) as stop, stop.looked_for():
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        assert stop.is_made
    assert signal.getsignal(signal.SIGTERM) is before


def test_work_that_does_not_look_for_it_is_torn() -> None:
    with stop_request(signal.SIGINT) as stop:
        with stop.looked_for():
            pass
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


class Compiled:
    """Something at whose end Ctrl-C is pressed; Python drops what a destructor raises."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_request_that_was_dropped_is_still_known() -> None:
    with stop_request(signal.SIGINT) as stop:
        compiled = Compiled()
        del compiled
        assert stop.is_made


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_what_fails_after_a_dropped_request_is_no_fault() -> None:
    with pytest.raises(KeyboardInterrupt), stop_request(signal.SIGINT):
        compiled = Compiled()
        del compiled
        raise RuntimeError("half done")


def test_what_fails_without_a_request_is_a_fault() -> None:
    with pytest.raises(RuntimeError, match="by itself"), stop_request(signal.SIGINT):
        raise RuntimeError("by itself")
