"""``racecar localize``: a bag and a map become the car's poses."""

from collections.abc import Collection
from typing import Annotated

import typer

from racecar.pipelines.commands.exit_codes import NOT_GOOD_ENOUGH
from racecar.pipelines.commands.options import (
    BagArgument,
    ConfigOption,
    DurationOption,
    ImuTopicOption,
    JsonOption,
    LaserPoseOption,
    MapOption,
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
from racecar.pipelines.commands.outputs import Flags, WritesFolder


def _names(flags: Flags) -> Collection[str]:
    """Of what is written into --out."""
    return ("trajectory.tum", "overlay.png", "report.json", *(["record"] if flags["record"] else []))


def localize(
    bag: BagArgument,
    map: MapOption,
    out: Annotated[OutputFolderOption, WritesFolder(_names)],
    initial_pose: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            "--initial-pose",
            metavar="X Y YAW",
            help="Where the car starts, in metres and radians of the map.",
            show_default=False,
        ),
    ] = None,
    anywhere: Annotated[
        bool, typer.Option("--global", help="Search the whole map for where the car starts.")
    ] = False,
    config: ConfigOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    no_odom: NoOdomOption = False,
    imu_topic: ImuTopicOption = None,
    no_imu: NoImuOption = False,
    laser_pose: LaserPoseOption = None,
    start: StartOption = 0.0,
    duration: DurationOption = None,
    record: RecordOption = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit code 3 when the drive is not localized.")
    ] = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Estimate where the car was on a map: trajectory.tum, overlay.png and report.json.

    Without --initial-pose and --global the bag that made the map starts where it was then, by the map's
    report.json and trajectory.tum; any other starts anywhere.

    When the map turns out to be of another place, the search stops.

    Example: racecar localize drive.bag --map runs/drive --out runs/localized
    """
    from racecar.maps.map_files import load_map
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report

    report = Report("racecar localize")
    loaded = load_config(config)
    report.add("inputs", {"bag": bag, "map": map, "config": config})
    with (
        output_folder(out) as folder,
        bag_reading(
            scan_topic=scan_topic,
            odom_topic=odom_topic,
            no_odom=no_odom,
            laser_pose=laser_pose,
            imu_topic=imu_topic,
            no_imu=no_imu,
            start=start,
            duration=duration,
        ).open(bag) as reader,
    ):
        grid = load_map(map)
        with report.stage("loading"):  # after bag and map, so that their faults are reported at once
            from racecar.localization.verdict.drive_quality import DriveVerdict
            from racecar.pipelines.commands.localization_summary import print_localization
            from racecar.pipelines.runs.localized_bag import localize_reader
        localized = localize_reader(
            reader,
            grid,
            loaded,
            report,
            map_path=map,
            initial_pose=initial_pose,
            anywhere=anywhere,
            seed=seed,
            quiet=quiet,
            record_into=folder if record else None,
        )
        localized.write(folder)
    if json is not None:
        report.write(json)
    if not quiet:
        print_localization(report, localized.quality, out, json)
    if strict and localized.quality.verdict != DriveVerdict.LOCALIZED:
        raise typer.Exit(NOT_GOOD_ENOUGH)
