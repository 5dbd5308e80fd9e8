"""Work in other processes: one at a time, many at once, and how far each is."""

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import monotonic, sleep

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.runs.evaluation.relations import load_relations
from racecar.pipelines.runs.other_process import ProcessDiedError, in_fresh_process, start_beside
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.run_lock import run_lock
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


def work(out: Path, number: int) -> None:
    with run_lock(out), (out.parent / "log").open("a") as log:
        log.write(f"begin {number}\n")
        log.flush()
        sleep(0.01)
        log.write(f"end {number}\n")


def test_runs_take_turns_and_leave_nothing(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(partial(work, tmp_path / "out"), range(16)))
    lines = (tmp_path / "log").read_text().split()
    assert lines[1::4] == lines[3::4]  # who begins ends before the next begins
    assert len(set(lines[1::4])) == 16
    assert [path.name for path in tmp_path.iterdir()] == ["log"]


def take_and_die(out: Path) -> None:
    run_lock(out).__enter__()
    os._exit(1)


def test_the_lock_of_the_dead_is_free(tmp_path: Path) -> None:
    with pytest.raises(ProcessDiedError):
        in_fresh_process(partial(take_and_die, tmp_path / "out"))
    with run_lock(tmp_path / "out"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_results_come_in_the_order_of_the_arguments() -> None:
    assert ParallelRuns(quiet=True).run("Test", pow, [(value, 2) for value in range(8)]) == [
        value**2 for value in range(8)
    ]


def test_work_is_done_in_other_processes_but_for_timing() -> None:
    assert os.getpid() not in ParallelRuns(quiet=True).run("Test", os.getpid, [()] * 4)
    assert ParallelRuns(quiet=True).here.run("Test", os.getpid, [()]) == [os.getpid()]


def test_runs_on_a_dask_cluster() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        done = ParallelRuns(cluster.scheduler_address, quiet=True).run(
            "Test", pow, [(value, 2) for value in range(4)]
        )
    assert done == [0, 1, 4, 9]


def test_a_missing_scheduler_is_one_sentence() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(UserError, match="no dask scheduler at tcp://127"):
        ParallelRuns("tcp://127.0.0.1:1", quiet=True).run("Test", pow, [(1, 1)])


@pytest.mark.parametrize(("total", "shares"), [(4.0, [0.0, 0.25, 1.0]), (0.0, [0.0, 1.0, 1.0])])
def test_a_listener_hears_the_share_that_is_done(total: float, shares: list[float]) -> None:
    heard: list[tuple[str, float]] = []
    with RunContext(listen=lambda *news: heard.append(news)).progress("Reading", total) as advance_to:
        advance_to(1.0)
        advance_to(5.0)
    assert heard == [("Reading", share) for share in shares]
