"""Many bags become maps at once; what is done is kept, and what fails does not stop the rest."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial

from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome, mapped_row
from racecar.pipelines.runs.error_sentences import in_one_sentence
from racecar.pipelines.runs.mapping_job import MappingJob, carry_out, is_done
from racecar.pipelines.runs.other_process import ProcessDiedError, in_fresh_process, leave_terminal_alone
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.runs.run_lock import run_lock


def map_all(jobs: Sequence[MappingJob], parallel: ParallelRuns) -> Iterator[BatchRow]:
    """Yield what became of each job, as soon as it is known.

    Each has a process of its own, so that one that dies takes nothing with it. When the iteration is broken
    off, or this process dies, so do they. Raises UserError when the cluster cannot be reached.
    """
    work = partial(_map_apart, threads=parallel.threads_of_each(len(jobs)))
    arguments = [(job,) for job in jobs]
    with closing(parallel.as_finished("Mapping", work, arguments, starts_process=True)) as finished:
        for number, failure in finished:
            job = jobs[number]
            yield mapped_row(job) if failure is None else BatchRow(job, Outcome.FAILED, failure)


def _map_apart(job: MappingJob, *, threads: int) -> str | None:
    """Do a job in a process of its own; the reason why there is no map, or None."""
    try:
        return in_fresh_process(partial(_map_or_explain, job), threads=threads)
    except ProcessDiedError as death:
        return _explain(death)


def _map_or_explain(job: MappingJob) -> str | None:
    leave_terminal_alone()
    try:
        with run_lock(job.out):
            if not is_done(job):  # by another batch that was at it
                carry_out(job, Report("racecar map"), quiet=True)
    except Exception as error:
        return in_one_sentence(error)
    return None


def _explain(death: ProcessDiedError) -> str:
    if death.exit_code == -signal.SIGKILL:
        return (
            "Its process was killed, as the system does when memory runs out: run fewer at once (--jobs), or "
            "map a part of the bag (--duration)."
        )
    if death.exit_code < 0:
        ended_by = signal.Signals(-death.exit_code).name
        return f"Its process was ended by {ended_by}; map the bag on its own to see what it reports."
    return f"Its process ended with code {death.exit_code}; map the bag on its own to see what it reports."
