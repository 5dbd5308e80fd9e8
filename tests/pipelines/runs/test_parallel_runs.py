"""Many runs: on all cores, on a cluster, in order, and told when the cluster is not there."""

import os

import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.runs.parallel_runs import ParallelRuns


def test_results_come_in_the_order_of_the_arguments() -> None:
    assert ParallelRuns(quiet=True).run("Test", pow, [(value, 2) for value in range(8)]) == [
        value**2 for value in range(8)
    ]


def test_work_is_done_in_other_processes_but_for_timing() -> None:
    assert os.getpid() not in ParallelRuns(quiet=True).run("Test", os.getpid, [()] * 4)
    assert ParallelRuns(quiet=True).here("Test", os.getpid, [()]) == [os.getpid()]


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
