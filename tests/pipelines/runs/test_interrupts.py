import signal
import subprocess
import sys
from pathlib import Path

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


WORK = """
import os, signal, sys, time
from pathlib import Path
from racecar.maps.whole_files import staging_folder
from racecar.pipelines.runs.interrupts import end_like_ctrl_c
signal.signal(signal.SIGHUP, signal.SIG_IGN if sys.argv[2] == "survive" else signal.SIG_DFL)
end_like_ctrl_c()
with staging_folder(Path(sys.argv[1]), Path("run")):
    child = os.fork()
    if child == 0:
        time.sleep(60)
    try:
        print(child, flush=True)
        for _ in range(600):
            time.sleep(0.1)
            print(flush=True)
    finally:
        os.kill(child, signal.SIGTERM)
        assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGTERM
"""


def start_work(folder: Path, mode: str = "end") -> "subprocess.Popen[str]":
    command = [sys.executable, "-c", WORK, str(folder), mode]
    work = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert work.stdout is not None
    work.stdout.readline()
    assert len(list(folder.iterdir())) == 1
    return work


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_whoever_ends_us_leaves_nothing_behind(tmp_path: Path, number: signal.Signals) -> None:
    """And a copy of the process, as it runs beside, is ended at once by the same signal."""
    work = start_work(tmp_path)
    work.send_signal(number)
    _, error = work.communicate(timeout=20)
    assert "KeyboardInterrupt" in error
    assert "AssertionError" not in error
    assert list(tmp_path.iterdir()) == []


def test_a_closed_terminal_is_survived_where_it_is_to_be(tmp_path: Path) -> None:
    work = start_work(tmp_path, "survive")
    work.send_signal(signal.SIGHUP)
    assert work.stdout is not None
    assert [work.stdout.readline() for _ in range(3)] == ["\n"] * 3
    work.send_signal(signal.SIGTERM)
    work.communicate(timeout=20)
    assert list(tmp_path.iterdir()) == []
