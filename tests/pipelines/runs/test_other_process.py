import multiprocessing
import os
import signal
from functools import partial
from pathlib import Path
from time import sleep

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.evaluation.relations import load_relations
from racecar.pipelines.runs.other_process import in_fresh_process, start_beside


def test_the_process_is_another_one_each_time() -> None:
    processes = {os.getpid(), in_fresh_process(os.getpid), in_fresh_process(os.getpid)}
    assert len(processes) == 3


def test_errors_come_back() -> None:
    with pytest.raises(UserError, match="nowhere"):
        in_fresh_process(partial(load_relations, Path("nowhere.relations")))


def test_a_death_is_told() -> None:
    with pytest.raises(RuntimeError, match="ended with code 3"):
        in_fresh_process(partial(os._exit, 3))


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
