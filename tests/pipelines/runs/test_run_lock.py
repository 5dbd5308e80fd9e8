"""One run at a time writes to a folder."""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import sleep

import pytest

from racecar.pipelines.runs.other_process import ProcessDiedError, in_fresh_process
from racecar.pipelines.runs.run_lock import run_lock


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
