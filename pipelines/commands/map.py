"""``racecar map``: a bag becomes a map."""

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.exit_codes import INTERRUPTED, NOT_GOOD_ENOUGH
from racecar.pipelines.commands.options import (
    ConfigOption,
    DurationOption,
    ImuTopicOption,
    JsonOption,
    LaserPoseOption,
    NoImuOption,
    NoOdomOption,
    OdomTopicOption,
    OutputFolderOption,
    QuietOption,
    RecordOption,
    ScanTopicOption,
    SchedulerOption,
    SeedOption,
    StartOption,
    bag_reading,
)
from racecar.pipelines.commands.outputs import Flags, WritesFolder
from racecar.pipelines.commands.rendering_options import (
    DxfOption,
    PlyOption,
    PngOption,
    SvgOption,
    map_files,
    requested_files,
)

if TYPE_CHECKING:
    from racecar.pipelines.runs.mapping_job import MappingJob

ContinueOption = Annotated[
    Path | None,
    typer.Option(
        "--continue",
        metavar="DIR",
        help="Extend the map that an earlier run left in DIR; the new drive finds its place there.",
        show_default=False,
    ),
]
InitialPoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--initial-pose",
        metavar="X Y YAW",
        help="Where the drive starts on the map of --continue, in metres and radians; else all of it is "
        "searched.",
        show_default=False,
    ),
]


OptionalBagArgument = Annotated[
    Path | None,
    typer.Argument(
        metavar="BAG",
        help="A ROS 1 .bag, a ROS 2 bag folder, or a single .db3 or .mcap file; none with --batch.",
        show_default=False,
    ),
]
BatchOption = Annotated[
    Path | None,
    typer.Option(
        "--batch",
        metavar="LIST",
        help="Map many bags: those that a text file names, a path per line, or all that are in a folder, "
        "each into a folder of its own in --out.",
        show_default=False,
    ),
]
JobsOption = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        metavar="N",
        min=1,
        help="With --batch: map at most N bags at once; by default as many as there are cores.",
        show_default=False,
    ),
]


def _names(flags: Flags) -> Collection[str]:
    """Of what is written into --out."""
    from racecar.pipelines.batch.batch_results import FIGURES, PAGE

    return map_files(flags) if flags["batch"] is None else (PAGE, FIGURES)


def map(
    out: Annotated[OutputFolderOption, WritesFolder(_names, remakes="continue_")],
    bag: OptionalBagArgument = None,
    batch: BatchOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    no_odom: NoOdomOption = False,
    imu_topic: ImuTopicOption = None,
    no_imu: NoImuOption = False,
    laser_pose: LaserPoseOption = None,
    start: StartOption = 0.0,
    duration: DurationOption = None,
    continue_: ContinueOption = None,
    initial_pose: InitialPoseOption = None,
    ply: PlyOption = False,
    png: PngOption = False,
    svg: SvgOption = False,
    dxf: DxfOption = False,
    record: RecordOption = False,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Exit code 3 when the map is wrong; with --batch when any is not good, or missing.",
        ),
    ] = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
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
    loaded = load_config(config)
    reading = bag_reading(
        scan_topic=scan_topic,
        odom_topic=odom_topic,
        no_odom=no_odom,
        laser_pose=laser_pose,
        imu_topic=imu_topic,
        no_imu=no_imu,
        start=start,
        duration=duration,
    )
    job = MappingJob(
        bag or Path(),
        out,
        loaded,
        config_file=config,
        reading=reading,
        continued=continue_,
        initial_pose=initial_pose,
        requested=requested_files(ply=ply, png=png, svg=svg, dxf=dxf),
        record=record,
        seed=seed,
    )
    if batch is None:
        _map_one(job, strict=strict, json=json, quiet=quiet)
    else:
        from racecar.pipelines.commands.map_many import map_many
        from racecar.pipelines.runs.parallel_runs import ParallelRuns

        map_many(job, batch, ParallelRuns(scheduler, quiet, jobs), strict=strict, json=json)


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


def _map_one(job: "MappingJob", *, strict: bool, json: Path | None, quiet: bool) -> None:
    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.interrupts import STOP_SIGNALS
    from racecar.pipelines.runs.mapping_job import carry_out

    report = Report("racecar map")
    mapped = carry_out(job, report, quiet=quiet, stop_signals=STOP_SIGNALS)
    if json is not None:
        report.write(json)
    from racecar.mapping.quality.map_quality import Verdict
    from racecar.pipelines.commands.mapping_summary import print_mapping

    if not quiet:
        print_mapping(report, mapped.quality, job.out, json)
    if report.as_dict()["counts"].get("interrupted"):
        raise typer.Exit(INTERRUPTED)
    if strict and mapped.quality.verdict == Verdict.WRONG:
        raise typer.Exit(NOT_GOOD_ENOUGH)
