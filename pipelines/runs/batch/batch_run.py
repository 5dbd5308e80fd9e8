"""Map many bags at once; finished maps are kept, and a failure does not stop the others."""

import signal
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch.batch_page import Thumbnail, batch_page, map_thumbnail
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome, mapped_row
from racecar.pipelines.runs.error_sentences import in_one_sentence
from racecar.pipelines.runs.mapping_job import MappingJob, carry_out, is_done
from racecar.pipelines.runs.other_process import ProcessDiedError, in_fresh_process, leave_terminal_alone
from racecar.pipelines.runs.parallel_runs import ParallelRuns
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.runs.run_lock import run_lock

PAGE, FIGURES = "batch.html", "batch.json"


class Batch:
    """A row for each job, in their order, and the files in the batch's folder that show them."""

    def __init__(self, jobs: Sequence[MappingJob], out: Path, report: Report, made_by: str) -> None:
        """``made_by`` describes on the page how the maps were made. Finished jobs are not repeated."""
        self._rows = {
            job: mapped_row(job) if is_done(job) else BatchRow(job, Outcome.WAITING, "Not mapped yet.")
            for job in jobs
        }
        self._thumbnails: dict[str, Thumbnail] = {}
        self._out, self._report, self._made_by = out, report, made_by

    @property
    def rows(self) -> list[BatchRow]:
        """Rows in the order of the jobs."""
        return list(self._rows.values())

    def map_waiting(self, parallel: ParallelRuns) -> Iterator[BatchRow]:
        """Do the unfinished jobs, and yield each row as soon as it is known and on the page.

        Each job has its own process, so a crash affects no other job. The processes end when the iteration is
        abandoned or this process dies. Raises UserError when the cluster cannot be reached, or when the page
        and the figures cannot be written.
        """
        self._write()
        jobs = [job for job, row in self._rows.items() if row.outcome == Outcome.WAITING]
        work = partial(_map_apart, threads=parallel.threads_of_each(len(jobs)))
        arguments = [(job,) for job in jobs]
        with closing(parallel.as_finished("Mapping", work, arguments, starts_process=True)) as finished:
            for number, failure in finished:
                job = jobs[number]
                row = mapped_row(job) if failure is None else BatchRow(job, Outcome.FAILED, failure)
                self._rows[job] = row
                self._write()
                yield row

    def _write(self) -> None:
        """Write page and figures, completely or not at all."""
        for row in self.rows:
            is_new = row.outcome.has_map and row.name not in self._thumbnails
            if is_new and (thumbnail := map_thumbnail(row.job.out)) is not None:
                self._thumbnails[row.name] = thumbnail
        outcomes = Counter(row.outcome for row in self.rows)
        self._report.add("counts", {outcome.value: outcomes[outcome] for outcome in Outcome})
        self._report.add("bags", {row.name: row.as_dict() for row in self.rows})
        self._report.write(self._out / FIGURES)
        with write_atomically(self._out / PAGE) as partial_page:
            page = batch_page(self.rows, self._thumbnails, self._made_by)
            partial_page.write_text(page, encoding="utf-8", errors="replace")  # a path may not be valid text


def _map_apart(job: MappingJob, *, threads: int) -> str | None:
    """Do a job in its own process; returns the reason why there is no map, or None."""
    try:
        return in_fresh_process(partial(_map_or_explain, job), threads=threads)
    except ProcessDiedError as death:
        return _explain(death)


def _map_or_explain(job: MappingJob) -> str | None:
    leave_terminal_alone()
    try:
        with run_lock(job.out):
            if not is_done(job):  # another batch may have done it
                carry_out(job, RunContext(Report("racecar map")))
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
