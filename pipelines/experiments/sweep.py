"""Many runs that do not depend on each other, on all cores or on a cluster."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from typing import Any, TypeVar

import joblib

from racecar.maps.errors import UserError
from racecar.pipelines.runs.progress import progress_bar

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class ParameterSweep:
    """Does runs in parallel through joblib, on this machine's cores or on a dask cluster.

    A run draws its random numbers from a seed of its own, so the results do not depend on where it was done.
    """

    scheduler: str | None = None
    """Address of a dask scheduler, such as tcp://192.168.0.5:8786; None: the cores of this machine."""
    quiet: bool = False

    def run(
        self, what: str, work: Callable[..., _Result], arguments: Sequence[tuple[Any, ...]]
    ) -> list[_Result]:
        """``work(*arguments[i])`` for all i, in this order, with progress shown.

        Raises UserError when the cluster cannot be reached.
        """
        results = []
        with ExitStack() as stack:
            stack.enter_context(_engine(self.scheduler))
            advance_to = stack.enter_context(progress_bar(what, len(arguments), quiet=self.quiet))
            parallel = joblib.Parallel(n_jobs=-1, batch_size=1, return_as="generator")
            for result in parallel(joblib.delayed(work)(*each) for each in arguments):
                results.append(result)
                advance_to(len(results))
        return results

    def here(
        self, what: str, work: Callable[..., _Result], arguments: Sequence[tuple[Any, ...]]
    ) -> list[_Result]:
        """The same one after the other in this process, as measuring time asks for."""
        results = []
        with progress_bar(what, len(arguments), quiet=self.quiet) as advance_to:
            for each in arguments:
                results.append(work(*each))
                advance_to(len(results))
        return results


def _engine(scheduler: str | None) -> AbstractContextManager[Any]:
    if scheduler is None:
        return nullcontext()
    return _on_cluster(scheduler)


def _on_cluster(scheduler: str) -> AbstractContextManager[Any]:
    try:
        from dask.distributed import Client
    except ImportError as error:
        raise UserError(
            "--scheduler needs dask; install it with: pip install 'racecar-slam[dask]'."
        ) from error
    stack = ExitStack()
    try:
        stack.enter_context(Client(scheduler, timeout="5s"))  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise UserError(
            f"There is no dask scheduler at {scheduler}; start one with `dask scheduler` and name its "
            "address."
        ) from error
    stack.enter_context(joblib.parallel_config(backend="dask"))
    return stack
