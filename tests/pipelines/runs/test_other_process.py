import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import monotonic, sleep

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.runs.evaluation.relations import load_relations
from racecar.pipelines.runs.other_process import in_fresh_process, start_beside
from racecar.sensors.threads import thread_count


def until(is_so: Callable[[], object]) -> None:
    """Wait for something that comes; a minute without it is a failure."""
    deadline = monotonic() + 60.0
    while not is_so():
        assert monotonic() < deadline
        sleep(0.02)


def command_line(process: str) -> bytes:
    """Empty when it has ended."""
    try:
        return Path("/proc", process, "cmdline").read_bytes()
    except OSError:
        return b""


def test_the_process_is_another_one_each_time() -> None:
    processes = {os.getpid(), in_fresh_process(os.getpid), in_fresh_process(os.getpid)}
    assert len(processes) == 3


def test_errors_come_back() -> None:
    with pytest.raises(UserError, match="nowhere"):
        in_fresh_process(partial(load_relations, Path("nowhere.relations")))


def test_a_death_is_told() -> None:
    with pytest.raises(RuntimeError, match="ended with code 3"):
        in_fresh_process(partial(os._exit, 3))


def test_the_process_ends_with_the_one_that_waits_for_it() -> None:
    """It would otherwise write where the next run writes, too."""
    script = (
        "from functools import partial; from time import sleep;"
        "from racecar.pipelines.runs.other_process import in_fresh_process;"
        "in_fresh_process(partial(sleep, 600.0))"
    )
    waiting = subprocess.Popen([sys.executable, "-c", script], cwd=Path(__file__).parents[3])
    children = Path(f"/proc/{waiting.pid}/task/{waiting.pid}/children")
    until(lambda: b"spawn_main" in b"".join(map(command_line, children.read_text().split())))
    (process,) = [pid for pid in children.read_text().split() if b"spawn_main" in command_line(pid)]
    waiting.kill()
    waiting.wait()
    until(lambda: not command_line(process))


def test_threads_are_limited_there_only() -> None:
    before = dict(os.environ)
    assert in_fresh_process(partial(thread_count, 8), threads=3) == 3
    assert dict(os.environ) == before


def test_an_interrupt_ends_the_work() -> None:
    children = set(multiprocessing.active_children())  # workers of the experiments may be among them
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(KeyboardInterrupt):
            in_fresh_process(partial(sleep, 600.0))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert set(multiprocessing.active_children()) <= children


def test_ctrl_c_is_heard_by_the_one_who_waits() -> None:
    assert in_fresh_process(partial(signal.raise_signal, signal.SIGINT)) is None
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_work_goes_on_beside() -> None:
    receiver, sender = multiprocessing.Pipe(duplex=False)
    start_beside(lambda: sender.send(os.getpid()))
    assert receiver.poll(60.0)
    assert receiver.recv() != os.getpid()
