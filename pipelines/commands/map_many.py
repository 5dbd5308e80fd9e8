"""The work of ``racecar map --batch``, and its output."""

import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from racecar.maps.errors import UserError
from racecar.pipelines.commands.outputs import check
from racecar.pipelines.commands.results import INTERRUPTED, NOT_GOOD_ENOUGH, where_to_look
from racecar.pipelines.commands.tables import print_tables
from racecar.pipelines.commands.terminal import one_line, teller
from racecar.pipelines.files.outputs import output_folder
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.batch.bag_search import find_bags
from racecar.pipelines.runs.batch.batch_page import headline, shown
from racecar.pipelines.runs.batch.batch_row import BatchRow, Outcome
from racecar.pipelines.runs.batch.batch_run import FIGURES, PAGE, Batch
from racecar.pipelines.runs.batch.run_folders import run_folders
from racecar.pipelines.runs.mapping_job import MappingJob
from racecar.pipelines.runs.parallel_runs import ParallelRuns

_COLORS = {
    Outcome.GOOD: "green",
    Outcome.DOUBTFUL: "yellow",
    Outcome.WRONG: "red",
    Outcome.FAILED: "red",
    Outcome.WAITING: "dim",
}


def map_many(
    pattern: MappingJob,
    listed: Path,
    parallel: ParallelRuns,
    *,
    strict: bool,
    replace: bool,
    json: Path | None,
) -> None:
    """Do the job of the ``pattern`` with each bag that is ``listed``, each in its own folder inside the
    pattern's. A map that was made otherwise is only replaced when told to ``replace`` it."""
    out = pattern.out
    with output_folder(out):  # a folder that cannot be written to is reported now, not after hours
        jobs = _jobs(pattern, find_bags(listed, out))
    report = _report(pattern, listed)
    batch = Batch(jobs, out, report, _made_by(pattern, listed))
    waiting = [row.job for row in batch.rows if row.outcome == Outcome.WAITING]
    check([job.place for job in waiting], [job.bag for job in waiting], replace=replace)
    announce = teller(quiet=parallel.quiet, on_stderr=True)
    if done := sum(row.outcome.has_map for row in batch.rows):
        announce(f"{done} of {len(jobs)} bags are mapped already.")
    try:
        for number, row in enumerate(batch.map_waiting(parallel), start=done + 1):
            announce(_row_line(row, number, len(jobs)))
    except KeyboardInterrupt:
        announce(f"Stopped at {headline(batch.rows)}. The same command goes on from here.")
        raise typer.Exit(INTERRUPTED) from None
    if json is not None:
        report.write(json)
    if parallel.quiet:
        _print_failures(batch.rows)
    else:
        _print_batch(batch.rows, out, json)
    _leave(batch.rows, out, strict)


def _jobs(pattern: MappingJob, bags: Sequence[Path]) -> list[MappingJob]:
    """Paths are absolute, since a cluster's workers have other working directories."""
    folders = run_folders(bags, pattern.out.absolute(), reserved=(PAGE, FIGURES))
    return [replace(pattern, bag=bag, out=folder) for bag, folder in zip(bags, folders, strict=True)]


def _report(pattern: MappingJob, batch: Path) -> Report:
    report = Report("racecar map --batch")
    report.add("inputs", {"batch": batch, "config": pattern.config_file})
    settings = pattern.config.mapping.model_dump()
    report.add("inputs", {"reading": asdict(pattern.reading), "settings": settings})
    return report


def _made_by(pattern: MappingJob, batch: Path) -> str:
    file = pattern.config_file
    settings = "the default settings" if file is None else f"the settings of {file}"
    return f"Made by racecar map --batch {batch} with {settings}."


def _print_failures(rows: Sequence[BatchRow]) -> None:
    for row in rows:
        if not row.outcome.has_map:
            print(one_line(f"{row.name}: {row.reason}"), file=sys.stderr)


def _print_batch(rows: Sequence[BatchRow], out: Path, json: Path | None) -> None:
    print_tables(_batch_table(rows))
    print(where_to_look(out, PAGE, json or out / FIGURES))
    print(f"{headline(rows)}.")


def _batch_table(rows: Sequence[BatchRow]) -> Table:
    """One line per bag, with what fits on a terminal; the page has more."""
    table = Table(box=box.SIMPLE, pad_edge=False)
    table.add_column("bag", overflow="fold", min_width=12)
    table.add_column("verdict", no_wrap=True)
    for column in ("path\n(m)", "off per 10 m,\nin all (m)", "took\n(s)"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("why", overflow="fold", min_width=20)
    for row in rows:
        outcome = f"[{_COLORS[row.outcome]}]{row.outcome.value}[/]"
        report = row.report
        errors = (report.quality.error_per_10_m, report.quality.error_of_whole_m)
        off = ", ".join(shown(error, 3) for error in errors if error is not None)
        numbers = (shown(report.result.path_metres, 1), off, shown(report.stages.total.wall_seconds, 1))
        table.add_row(escape(row.name), outcome, *numbers, escape(row.reason))
    return table


def _row_line(row: BatchRow, number: int, total: int) -> str:
    """The announcement when a bag is done."""
    what = f"{number}/{total} {row.name}: {row.outcome.value}"
    if not row.outcome.has_map:
        return f"{what}. {row.reason}"
    metres, seconds = row.report.result.path_metres, row.report.stages.total.wall_seconds
    return f"{what}, {metres or 0.0:.1f} m of path, {seconds or 0.0:.1f} s."


def _leave(rows: Sequence[BatchRow], out: Path, strict: bool) -> None:
    """Exit with the right code. Raises UserError when there is not a single map."""
    outcomes = {row.outcome for row in rows}
    if not any(outcome.has_map for outcome in outcomes):
        raise UserError(f"No bag became a map; {out / PAGE} gives the reason of each.")
    if strict and outcomes != {Outcome.GOOD}:
        raise typer.Exit(NOT_GOOD_ENOUGH)
