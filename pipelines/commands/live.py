"""``racecar live``: the ROS 2 nodes that run on the car."""

import os
from pathlib import Path
from typing import Annotated

import typer

from pipelines.live.ros_arguments import RosCommand
from pipelines.options import ConfigOption, JsonOption, SeedOption

live = typer.Typer(help="The ROS 2 nodes that run on the car.")


@live.callback()
def _describe() -> None:
    """The ROS 2 nodes that run on the car, and the files to start them with."""


def _state_folder() -> Path:
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "racecar"


@live.command(cls=RosCommand)
def localize(
    context: typer.Context,
    map: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="A map's YAML file, a folder with map.yaml, or a shipped map: building, track. "
            "When not given, the map is awaited on /map.",
            show_default=False,
        ),
    ] = None,
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
        bool, typer.Option("--global", help="Search the whole map, also where a pose is remembered.")
    ] = False,
    memory: Annotated[
        Path | None,
        typer.Option(
            "--memory",
            metavar="DIR",
            help="Folder where the pose is remembered over a restart; ~/.local/state/racecar when not given.",
            show_default=False,
        ),
    ] = None,
    no_memory: Annotated[bool, typer.Option("--no-memory", help="Do not remember the pose.")] = False,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Tell where the car is on a map, as it drives. Ctrl-C ends it.

    Topics, parameters and frames: see the README, or the commented files that `racecar live files` names.

    Example: racecar live localize --map runs/drive

    With other topics: racecar live localize --map runs/drive --ros-args -r odom:=/vesc/odom
    """
    from pipelines.live.ros_start import start_ros

    start_ros()

    import numpy as np

    from localization.warm_up import warm_up
    from maps.errors import UserError
    from maps.map_files import load_map
    from pipelines.config_file import load_config
    from pipelines.live.localizer_node import LocalizerNode, Start
    from pipelines.live.run import ros_node, spin
    from pipelines.report import write_json

    if initial_pose is not None and anywhere:
        raise UserError("--initial-pose and --global exclude each other; give one of them.")
    settings = load_config(config).localization
    start = Start(
        grid=None if map is None else load_map(map),
        initial_pose=None if initial_pose is None else np.array(initial_pose),
        anywhere=anywhere,
        memory=None if no_memory else memory or _state_folder(),
        seed=seed,
    )
    with ros_node("racecar_localizer", context.obj) as node:
        warm_up()
        localizer = LocalizerNode(node, settings, start)
        localizer.start()
        try:
            spin(node, localizer.survive)
        finally:
            localizer.stop()
            if json is not None:
                write_json(json, localizer.summary())
