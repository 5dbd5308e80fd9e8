"""Many runs that do not depend on each other, on all cores or on a cluster."""

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
    """Does runs in parallel through joblib, on this machine's cores or on a dask cluster.

    A run draws its random numbers from a seed of its own, so the results do not depend on where it was done.
    """

    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://192.168.0.5:8786; None: the cores of this machine."""
    quiet: bool = False
    jobs: int | None = None
    """Runs at once on this machine, and never more than it has cores; None: as many as it has cores."""

    @property
    def workers(self) -> int:
        """How many runs this machine does at once."""
        cores: int = joblib.cpu_count()
        return cores if self.jobs is None else min(self.jobs, cores)

    @property
    def here(self) -> "ParallelRuns":
        """The same one after the other in this process, as measuring time asks for."""
        return ParallelRuns(quiet=self.quiet, jobs=1)

    def threads_of_each(self, runs: int) -> int:
        """How many threads each of so many runs may use, for all of them to have a core."""
        if self.scheduler is not None:
            return 1  # a cluster's workers have a core for each run that they do at once
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
        """Yield i and ``work(*arguments[i])``, each as soon as it is there, with progress shown.

        Work that ``starts_process`` only waits for a process of its own, which a thread can do; these
        processes are killed when the iteration is broken off. Raises UserError when the cluster cannot be
        reached, or is lost.
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
            "--scheduler needs dask; install it with: pip install 'racecar-slam[dask]'."
        ) from error
    for name in ("distributed", "distributed.client"):  # they log tracebacks of what we explain
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
