"""Run many independent jobs, on all cores or on a cluster."""

import logging
import multiprocessing
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import joblib

from racecar.maps.errors import UserError
from racecar.pipelines.runs.progress import progress_bar

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class ParallelRuns:
    """Executes runs in parallel through joblib, on this machine's cores or on a dask cluster.

    Each run has its own random seed, so the results do not depend on where it is executed.
    """

    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://192.168.0.5:8786; None uses the cores of this machine."""
    quiet: bool = False
    jobs: int | None = None
    """Maximum simultaneous runs on this machine, limited by its number of cores; None uses all cores."""

    @property
    def workers(self) -> int:
        """Number of simultaneous runs on this machine."""
        cores: int = joblib.cpu_count()
        return cores if self.jobs is None else min(self.jobs, cores)

    @property
    def here(self) -> "ParallelRuns":
        """The same, but one after the other in this process, as required for measuring time."""
        return ParallelRuns(quiet=self.quiet, jobs=1)

    def threads_of_each(self, runs: int) -> int:
        """Number of threads for each of this many runs, so that every run has a core."""
        if self.scheduler is not None:
            return 1  # a cluster's workers have a core for each simultaneous run
        cores: int = joblib.cpu_count()
        return max(1, cores // max(min(self.workers, runs), 1))

    def run(
        self, what: str, work: Callable[..., _Result], arguments: Sequence[tuple[Any, ...]]
    ) -> list[_Result]:
        """``work(*arguments[i])`` for all i, in this order, with progress shown.

        Raises UserError when the cluster cannot be reached.
        """
        results = dict(self.as_finished(what, work, arguments))
        return [results[number] for number in range(len(arguments))]

    def as_finished(
        self,
        what: str,
        work: Callable[..., _Result],
        arguments: Sequence[tuple[Any, ...]],
        *,
        starts_process: bool = False,
    ) -> Generator[tuple[int, _Result], None, None]:
        """Yield i and ``work(*arguments[i])`` as soon as each is finished, with progress shown.

        Work that ``starts_process`` only waits for its own process, so it runs in a thread; these processes
        are killed when the iteration is abandoned. Raises UserError when the cluster cannot be reached, or is
        lost.
        """
        calls = (joblib.delayed(_numbered)(number, work, each) for number, each in enumerate(arguments))
        with ExitStack() as stack:
            if starts_process:
                stack.enter_context(_children_killed_on_failure())
            if self.scheduler is not None:
                stack.enter_context(_on_cluster(self.scheduler))
            advance_to = stack.enter_context(progress_bar(what, len(arguments), quiet=self.quiet))
            parallel = joblib.Parallel(
                n_jobs=-1 if self.scheduler else self.workers,
                batch_size=1,
                return_as="generator_unordered",
                prefer="threads" if starts_process else None,
            )
            for done, result in enumerate(parallel(calls), start=1):
                advance_to(done)
                yield result


def _numbered(number: int, work: Callable[..., _Result], arguments: tuple[Any, ...]) -> tuple[int, _Result]:
    return number, work(*arguments)


@contextmanager
def _children_killed_on_failure() -> Iterator[None]:
    try:
        yield
    except BaseException:
        for child in multiprocessing.active_children():
            child.kill()
        raise


@contextmanager
def _on_cluster(scheduler: str) -> Iterator[None]:
    try:
        from dask.distributed import Client
        from distributed.client import FutureCancelledError
        from distributed.comm.core import CommClosedError
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise UserError(
            "--scheduler needs dask; `pip install '.[dask]'` in the clone of racecar-slam installs it."
        ) from error
    for name in ("distributed", "distributed.client"):  # they log tracebacks of errors that we explain
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(scheduler, timeout="5s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise UserError(
            f"There is no dask scheduler at {scheduler}; start one with `dask scheduler` and name its "
            "address."
        ) from error
    try:
        with client, joblib.parallel_config(backend="dask"):
            yield
    except (CommClosedError, FutureCancelledError, KilledWorker) as error:
        raise UserError(
            f"The dask cluster at {scheduler} was lost during the work; restart its scheduler and workers."
        ) from error
