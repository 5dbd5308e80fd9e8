"""``racecar localize``: a bag and a map become the car's poses."""

from contextlib import nullcontext
from typing import Annotated

import typer

from racecar.pipelines.commands.exit_codes import NOT_GOOD_ENOUGH
from racecar.pipelines.commands.options import (
    BagArgument,
    ConfigOption,
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
    open_bag,
)


def localize(
    bag: BagArgument,
    map: MapOption,
    out: OutputFolderOption,
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
    from racecar.maps.errors import UserError
    from racecar.maps.map_files import load_map
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report

    if initial_pose is not None and anywhere:
        raise UserError("--initial-pose and --global exclude each other; give one of them.")
    report = Report("racecar localize")
    loaded = load_config(config)
    settings = loaded.localization
    report.add(
        "inputs", {"bag": bag, "map": map, "config": config, "seed": seed, "settings": settings.model_dump()}
    )
    with (
        output_folder(out) as folder,
        open_bag(
            bag,
            scan_topic=scan_topic,
            odom_topic=odom_topic,
            no_odom=no_odom,
            laser_pose=laser_pose,
            imu_topic=imu_topic,
            no_imu=no_imu,
        ) as reader,
    ):
        grid = load_map(map)
        with report.stage(
            "loading"
        ):  # after bag and map were opened, so that their faults are reported at once
            import numpy as np

            from racecar.localization.localizer import Localizer
            from racecar.localization.verdict.drive_quality import DriveVerdict
            from racecar.localization.warm_up import warm_up
            from racecar.pipelines.commands.localization_summary import print_localization
            from racecar.pipelines.runs.calibration_run import calibrate
            from racecar.pipelines.runs.localization_run import (
                run_localization,
                save_localization,
                start_anywhere,
            )
            from racecar.pipelines.runs.mapping_drive import has_mapping_drive, mapping_trajectory
            from racecar.pipelines.view.recorder import Recorder

            warm_up(settings)
        with report.stage("self-calibration"):
            calibrate(reader, loaded.mapping.self_calibration, quiet=quiet)
        driven = mapping_trajectory(map, bag)
        with report.stage("preparing the map"):
            localizer = Localizer(grid, settings, np.random.default_rng(seed))
        if initial_pose is not None:
            localizer.set_pose(np.array(initial_pose))
        is_open = initial_pose is None and not anywhere
        if is_open and driven is None and has_mapping_drive(map):
            start_anywhere(report)
        with Recorder(folder, grid) if record else nullcontext() as recorder:
            run = run_localization(
                reader,
                localizer,
                grid,
                report,
                verdict=settings.verdict,
                start=driven if is_open else None,
                recorder=recorder,
                quiet=quiet,
            )
        save_localization(run, grid, driven, report, folder, title=bag.name)
    if json is not None:
        report.write(json)
    if not quiet:
        print_localization(report, run.quality, out)
    if strict and run.quality.verdict != DriveVerdict.LOCALIZED:
        raise typer.Exit(NOT_GOOD_ENOUGH)
