"""``racecar map``: make a map from a bag."""

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import (
    ConfigOption,
    OutputFolderOption,
    ReadingFlags,
    RecordOption,
    SchedulerOption,
)
from racecar.pipelines.commands.outputs import Flags, WritesFolder
from racecar.pipelines.commands.rendering_options import FileFlags, map_files
from racecar.pipelines.commands.results import INTERRUPTED, NOT_GOOD_ENOUGH, EndFlags

if TYPE_CHECKING:
    from racecar.pipelines.runs.mapping_job import MappingJob

ContinueOption = Annotated[
    Path | None,
    typer.Option(
        "--continue",
        metavar="DIR",
        help="Extend the map that an earlier run left in DIR; the new drive finds its place there.",
    ),
]
InitialPoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--initial-pose",
        metavar="X Y YAW",
        help="Where the drive starts on the map of --continue, in metres and radians; else all of it is "
        "searched.",
    ),
]


OptionalBagArgument = Annotated[
    Path | None,
    typer.Argument(
        metavar="BAG",
        help="A ROS 1 .bag, a ROS 2 bag folder, or a single .db3 or .mcap file; none with --batch.",
    ),
]
BatchOption = Annotated[
    Path | None,
    typer.Option(
        "--batch",
        metavar="LIST",
        help="Map many bags: those that a text file names, a path per line, or all that are in a folder, "
        "each into a folder of its own in --out.",
    ),
]
JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        metavar="N",
        min=1,
        help="With --batch: map at most N bags at once; by default as many as there are cores.",
    ),
]


def _names(flags: Flags) -> Collection[str]:
    """Names of the files written into --out."""
    from racecar.pipelines.runs.batch.batch_run import FIGURES, PAGE

    return map_files(flags) if flags["batch"] is None else (PAGE, FIGURES)


def _remade(flags: Flags) -> Path | None:
    """A batch goes on in its folder."""
    folder: Path | None = flags["continue_"] if flags["batch"] is None else flags["out"]
    return folder


def map(
    *,
    out: Annotated[OutputFolderOption, WritesFolder(_names, remakes=_remade)],
    bag: OptionalBagArgument = None,
    batch: BatchOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    reading: ReadingFlags,
    continue_: ContinueOption = None,
    initial_pose: InitialPoseOption = None,
    files: FileFlags,
    record: RecordOption = False,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Exit code 3 when the map is wrong; with --batch when any is not good, or missing.",
        ),
    ] = False,
    ending: EndFlags,
    replace: bool = False,
) -> None:
    """Build a map from a bag: map.png, map.yaml and map.pgm, trajectory.tum, report.json and more.

    Ctrl-C stops the reading and makes a map of what was read so far.

    Example: racecar map drive.bag --out runs/drive

    Another day: racecar map more.bag --out runs/both --continue runs/drive

    Many bags at once, and a page of what became of each: racecar map --batch recordings --out runs
    """
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.runs.mapping_job import MappingJob

    _refuse_contradiction(bag, batch, jobs, scheduler, continue_, initial_pose)
    job = MappingJob(
        bag or Path(),
        out,
        load_config(config),
        config_file=config,
        reading=reading.parsed(),
        continued=continue_,
        initial_pose=initial_pose,
        requested=files.requested,
        record=record,
    )
    if batch is None:
        _map_one(job, ending, strict=strict)
    else:
        from racecar.pipelines.commands.map_many import map_many
        from racecar.pipelines.runs.parallel_runs import ParallelRuns

        map_many(
            job,
            batch,
            ParallelRuns(scheduler, ending.quiet, jobs),
            strict=strict,
            replace=replace,
            json=ending.json,
        )


def _refuse_contradiction(
    bag: Path | None,
    batch: Path | None,
    jobs: int | None,
    scheduler: str | None,
    continued: Path | None,
    initial_pose: tuple[float, float, float] | None,
) -> None:
    from racecar.maps.errors import UserError

    if batch is None and bag is None:
        raise UserError("There is nothing to map: give a BAG, or a list or folder of bags with --batch.")
    if batch is None and (jobs is not None or scheduler is not None):
        raise UserError("--jobs and --scheduler are for many bags: name these with --batch.")
    if batch is not None and bag is not None:
        raise UserError(f"Give {bag} or --batch, not both; a list for --batch may name {bag}, too.")
    if batch is not None and (continued is not None or initial_pose is not None):
        raise UserError(
            "--continue and --initial-pose are for one bag; `racecar merge` joins the maps that --batch made."
        )
    if jobs is not None and scheduler is not None:
        raise UserError("--jobs is for this machine; on a cluster, start fewer workers or more instead.")


def _map_one(job: "MappingJob", ending: EndFlags, *, strict: bool) -> None:
    from racecar.pipelines.runs.interrupts import STOP_SIGNALS
    from racecar.pipelines.runs.mapping_job import carry_out

    run = carry_out(job, ending.context("racecar map", stop_signals=STOP_SIGNALS))
    report, (width, height) = run.report.contents, run.result.tiled.metres
    done = (
        f"Mapped {len(run.trajectory)} scans over {report.result.path_metres or 0.0:.1f} m of path into a "
        f"map of {width:.0f} × {height:.0f} m in {run.report.seconds:.1f} s."
    )
    ending.end(run.report, [done], job.out, "map.png", run.quality.summary)
    if report.counts.interrupted:
        raise typer.Exit(INTERRUPTED)
    if strict and run.quality.verdict.value == "wrong":
        raise typer.Exit(NOT_GOOD_ENOUGH)
