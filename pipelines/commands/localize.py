"""``racecar localize``: a bag and a map become the car's poses."""

from contextlib import nullcontext
from typing import Annotated

import typer

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
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Estimate where the car was on a map: trajectory.tum, overlay.png and report.json.

    Without --initial-pose and --global the car starts where the mapping drive was at that time, if the map's
    folder holds its trajectory.tum, else anywhere.

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
            from racecar.localization.warm_up import warm_up
            from racecar.pipelines.commands.localization_summary import print_localization
            from racecar.pipelines.runs.calibration_run import calibrate
            from racecar.pipelines.runs.localization_run import (
                mapping_trajectory,
                run_localization,
                save_localization,
            )
            from racecar.pipelines.view.recorder import Recorder

            warm_up(settings)
        with report.stage("self-calibration"):
            calibrate(reader, loaded.mapping.self_calibration, quiet=quiet)
        driven = mapping_trajectory(map)
        with report.stage("preparing the map"):
            localizer = Localizer(grid, settings, np.random.default_rng(seed))
        if initial_pose is not None:
            localizer.set_pose(np.array(initial_pose))
        is_open = initial_pose is None and not anywhere
        start = driven if is_open else None
        with Recorder(folder, grid) if record else nullcontext() as recorder:
            run = run_localization(
                reader, localizer, grid, report, start=start, recorder=recorder, quiet=quiet
            )
        save_localization(run, grid, driven, report, folder, title=bag.name)
    if json is not None:
        report.write(json)
    if not quiet:
        print_localization(report, out)
