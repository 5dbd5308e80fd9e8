"""``racecar map``: a bag becomes a map."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.exit_codes import INTERRUPTED, NOT_GOOD_ENOUGH
from racecar.pipelines.commands.options import (
    BagArgument,
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
    SeedOption,
    StartOption,
    bag_reading,
)
from racecar.pipelines.commands.rendering_options import (
    DxfOption,
    PlyOption,
    PngOption,
    SvgOption,
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


def map(
    bag: BagArgument,
    out: OutputFolderOption,
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
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 3 when the map is wrong.")] = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Build a map from a bag: map.png, map.yaml and map.pgm, trajectory.tum, report.json and more.

    Ctrl-C stops the reading and makes a map of what was read so far.

    A run that was killed goes on where it was when the same command is repeated.

    Example: racecar map drive.bag --out runs/drive

    Another day: racecar map more.bag --out runs/both --continue runs/drive
    """
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.runs.mapping_job import MappingJob

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
        bag,
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
    _map_one(job, strict=strict, json=json, quiet=quiet)


def _map_one(job: "MappingJob", *, strict: bool, json: Path | None, quiet: bool) -> None:
    from rich.console import Console

    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.interrupts import STOP_SIGNALS
    from racecar.pipelines.runs.mapping_job import carry_out

    report = Report("racecar map")
    console = Console(stderr=True, quiet=quiet, highlight=False, soft_wrap=True)
    mapped = carry_out(
        job,
        report,
        quiet=quiet,
        announce=lambda sentence: console.print(sentence, markup=False),
        stop_signals=STOP_SIGNALS,
    )
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
