"""Many jobs: what fails or dies is a row, the others go on, and what is shown follows their list."""

import json
import os
import signal
from pathlib import Path

import pytest

from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch import batch_run
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome
from racecar.pipelines.runs.batch.batch_run import FIGURES, PAGE, Batch
from racecar.pipelines.runs.mapping_job import MappingJob
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from tests.pipelines.bag_samples import write_bag


def jobs(folder: Path, *names: str) -> list[MappingJob]:
    return [MappingJob(folder / name, folder / "out" / name, load_config(None)) for name in names]


def outcomes(done: list[BatchRow]) -> dict[str, tuple[Outcome, str]]:
    return {row.name: (row.outcome, row.reason) for row in done}


def die(job: MappingJob) -> str | None:
    """In place of mapping: the name says how."""
    if job.bag.name == "survives":
        return "It is broken."
    os.kill(os.getpid(), getattr(signal, job.bag.name))
    return None


def test_a_process_that_dies_is_a_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch_run, "_map_or_explain", die)
    names = ("SIGKILL", "survives", "SIGSEGV")
    batch = Batch(jobs(tmp_path, *names), tmp_path, Report("racecar map --batch"), "Made by hand.")
    done = outcomes(list(batch.map_waiting(ParallelRuns(quiet=True))))
    assert {outcome for outcome, _ in done.values()} == {Outcome.FAILED}
    assert done["survives"][1] == "It is broken."
    assert "memory" in done["SIGKILL"][1]
    assert "--jobs" in done["SIGKILL"][1]
    assert "SIGSEGV" in done["SIGSEGV"][1]
    assert [row.name for row in batch.rows] == list(names)
    assert list(json.loads((tmp_path / FIGURES).read_text())["bags"]) == list(names)
    page = (tmp_path / PAGE).read_text()
    assert sorted(names, key=lambda name: page.index(f'<td class="bag">{name}<')) == list(names)


def test_a_dask_cluster_maps_too(tmp_path: Path) -> None:
    """Its workers are daemons, which Python lets have no children of their own."""
    distributed = pytest.importorskip("distributed")
    write_bag(tmp_path / "drive.bag", 100)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as cluster:
        parallel = ParallelRuns(cluster.scheduler_address, quiet=True)
        listed = jobs(tmp_path, "drive.bag", "missing.bag")
        batch = Batch(listed, tmp_path, Report("racecar map --batch"), "Made by a cluster.")
        done = outcomes(list(batch.map_waiting(parallel)))
    assert done["drive.bag"][0].has_map
    assert done["missing.bag"] == (Outcome.FAILED, f"{tmp_path / 'missing.bag'} does not exist.")
