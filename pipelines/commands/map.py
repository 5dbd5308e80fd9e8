"""``racecar map``: a bag becomes a map."""

from typing import Annotated

import typer

from pipelines.options import (
    BagArgument,
    ConfigOption,
    JsonOption,
    LaserPoseOption,
    NoOdomOption,
    OdomTopicOption,
    OutputFolderOption,
    QuietOption,
    ScanTopicOption,
    SeedOption,
    open_bag,
)

_INTERRUPTED = 130

PlyOption = Annotated[
    bool, typer.Option("--ply", help="Also write points.ply, the map as a cloud of points.")
]


def map(
    bag: BagArgument,
    out: OutputFolderOption,
    config: ConfigOption = None,
    scan_topic: ScanTopicOption = None,
    odom_topic: OdomTopicOption = None,
    no_odom: NoOdomOption = False,
    laser_pose: LaserPoseOption = None,
    ply: PlyOption = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Build a map from a bag: map.yaml, map.pgm, trajectory.tum, pose_graph.g2o, map.png and report.json.

    Ctrl-C ends the reading and makes a map of what was read.

    Example: racecar map drive.bag --out runs/drive
    """
    from pipelines.config_file import load_config
    from pipelines.outputs import output_folder
    from pipelines.report import Report

    report = Report("racecar map")
    settings = load_config(config).mapping
    report.add("inputs", {"bag": bag, "config": config, "seed": seed, "settings": settings.model_dump()})
    with (
        output_folder(out) as folder,
        open_bag(
            bag, scan_topic=scan_topic, odom_topic=odom_topic, no_odom=no_odom, laser_pose=laser_pose
        ) as reader,
    ):
        with report.stage("loading"):  # after the bag was opened, so that its faults are told at once
            from pipelines.mapping_run import build_map, save_mapping
            from pipelines.point_map import save_point_map
            from pipelines.run_summary import print_mapping
        result = build_map(reader, settings, report, quiet=quiet)
        if ply:
            with report.stage("writing"):
                save_point_map(result.points, result.grid.resolution, folder / "points.ply")
        save_mapping(result, report, folder, title=bag.name)
    if json is not None:
        report.write(json)
    if not quiet:
        print_mapping(report, out)
    if report.as_dict()["counts"].get("interrupted"):
        raise typer.Exit(_INTERRUPTED)
