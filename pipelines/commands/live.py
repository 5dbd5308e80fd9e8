"""``racecar live``: the ROS 2 nodes that run on the car."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecar.pipelines.commands.live_simulate import simulate
from racecar.pipelines.commands.options import (
    ConfigOption,
    JsonOption,
    OutputFolderOption,
    SeedOption,
    StartOption,
)
from racecar.pipelines.commands.outputs import Flags, WritesFolder
from racecar.pipelines.commands.rendering_options import map_files
from racecar.pipelines.commands.results import where_figures_are, where_to_look
from racecar.pipelines.commands.terminal import teller
from racecar.pipelines.files.state_folder import state_folder
from racecar.pipelines.live.ros.arguments import RosCommand

if TYPE_CHECKING:
    from racecar.pipelines.runs.interrupts import StopRequest
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

ViewOption = Annotated[
    bool,
    typer.Option(
        "--view", help="Show everything in the browser, and send goals by clicks; on this machine only."
    ),
]
ViewPortOption = Annotated[
    int | None,
    typer.Option(
        "--view-port", metavar="N", min=1, max=65535, help="Port of the page; by default a free one."
    ),
]

live = typer.Typer(help="ROS 2 nodes: map, localize, or simulate a car.")


@live.callback()
def _describe() -> None:
    """The ROS 2 nodes that run on the car, one that is a car, and the files to start them with."""


@contextmanager
def _page(
    is_wanted: bool, title: str, port: int | None, *, tells_places: bool
) -> "Iterator[WatchScreen | None]":
    """The page in the browser, if wanted; ``tells_places`` sets whether clicks may set the car's pose."""
    if not is_wanted:
        yield None
        return
    from racecar.pipelines.studio.page import open_beside
    from racecar.pipelines.studio.watch.watch_screen import WatchScreen

    with open_beside(title, port or 0, partial(WatchScreen, tells_places=tells_places)) as (page, screen):
        teller(quiet=False)(f"Look at {page.address}")
        yield screen


@contextmanager
def _stop_request_once_warm(warm_up: Callable[[], None]) -> "Iterator[StopRequest]":
    """Load the kernels, then yield whether a stop is requested. Raises KeyboardInterrupt if it was while they
    were loaded, when numba drops one."""
    from racecar.pipelines.runs.interrupts import STOP_SIGNALS, stop_request

    with stop_request(*STOP_SIGNALS) as stop:
        with stop.looked_for():
            warm_up()
        if stop.is_made:
            raise KeyboardInterrupt
        yield stop


@live.command(cls=RosCommand)
def localize(
    context: typer.Context,
    map: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="MAP",
            help="A map's YAML file, a folder with map.yaml, or a shipped map: building, track. Without "
            "it, the node waits for a map on /map.",
        ),
    ] = None,
    initial_pose: StartOption = None,
    anywhere: Annotated[
        bool, typer.Option("--global", help="Global localization, even if a pose is remembered.")
    ] = False,
    memory: Annotated[
        Path | None,
        typer.Option(
            "--memory",
            metavar="DIR",
            help="Folder where the pose is remembered over a restart; default: ~/.local/state/racecar.",
        ),
        WritesFolder(lambda flags: ()),
    ] = None,
    no_memory: Annotated[bool, typer.Option("--no-memory", help="Do not remember the pose.")] = False,
    view: ViewOption = False,
    view_port: ViewPortOption = None,
    config: ConfigOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Estimate where the car is on a map, as it drives. Ctrl-C ends it.

    Topics, parameters and frames: see docs/reference/topics.md, or the commented files that
    `racecar live files` names.

    Example: racecar live localize --map runs/drive

    With other topics: racecar live localize --map runs/drive --ros-args -r odom:=/vesc/odom
    """
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()

    import numpy as np

    from racecar.localization.warm_up import warm_up, warm_up_filter
    from racecar.maps.errors import UserError
    from racecar.maps.map_files import load_map
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.report import write_json
    from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node, spin
    from racecar.pipelines.runs.other_process import start_beside

    if initial_pose is not None and anywhere:
        raise UserError("--initial-pose and --global exclude each other; give one of them.")
    loaded = load_config(config)
    until_the_end = TemporaryDirectory()
    folder = Path(until_the_end.name) if no_memory else memory or state_folder()

    def create(page: "WatchScreen | None", node: Any, is_first: bool) -> LocalizerNode:
        start = LocalizerStart(
            grid=None if map is None else load_map(map),
            initial_pose=np.array(initial_pose) if initial_pose is not None and is_first else None,
            anywhere=anywhere and is_first,
            memory=folder,
            seed=seed,
        )
        localizer = LocalizerNode(node, loaded, start, page)
        if is_first:
            localizer.say_what_is_not_read(context.obj)
        return localizer

    def load_kernels() -> None:
        start_beside(partial(warm_up_filter, loaded.localization))
        warm_up(loaded.localization)

    with (
        until_the_end,
        _stop_request_once_warm(load_kernels) as stop,
        _page(view, "racecar localizer", view_port, tells_places=True) as page,
        ros_node(
            "racecar_localizer", context.obj, partial(ManagedNode, create=partial(create, page))
        ) as node,
    ):
        node.bring_up()
        try:
            spin(node, node.survive, stop)
        finally:
            node.end()
            if json is not None:
                write_json(json, {"command": "racecar live localize", **node.summary()})
                print(where_figures_are(json))


def _continued(flags: Flags) -> Path | None:
    """The folder of a drive that goes on after its node was killed, which may have saved a map there."""
    from racecar.pipelines.live.saving.drive_log import DriveLog

    out: Path = flags["out"]
    return out if DriveLog(out).is_recent and not flags["anew"] else None


@live.command(cls=RosCommand)
def map(
    context: typer.Context,
    out: Annotated[OutputFolderOption, WritesFolder(map_files, remakes=_continued)],
    anew: Annotated[
        bool,
        typer.Option("--anew", help="Begin a new drive even if the node was killed during the last one."),
    ] = False,
    view: ViewOption = False,
    view_port: ViewPortOption = None,
    config: ConfigOption = None,
    json: JsonOption = None,
) -> None:
    """Build a map while the car drives. Ctrl-C ends the drive and saves the map; so does the service save_map
    in between. However it ends, the map so far is saved.

    If the node was killed within the last hour, the same command goes on with that drive.

    Example: racecar live map --out runs/drive
    """
    from racecar.pipelines.live.ros.start import start_ros

    start_ros()

    from racecar.mapping.warm_up import warm_up
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import write_json
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.mapper_node import MapperNode
    from racecar.pipelines.live.ros.run import ros_node, spin
    from racecar.pipelines.live.saving.drive_log import DriveLog
    from racecar.pipelines.live.saving.live_drive import LiveDrive
    from racecar.pipelines.live.saving.map_saving import MapOutput
    from racecar.pipelines.live.work.free_memory import keep_memory_together

    settings = load_config(config)
    tell = teller(quiet=False)
    drive = LiveDrive(MapOutput(out, settings, {"live": True}), DriveLog(out))
    with output_folder(out):
        pass  # so that no drive is lost
    keep_memory_together()
    if not anew:
        drive.log.go_on(tell)

    def create(page: "WatchScreen | None", node: Any, is_first: bool) -> MapperNode:
        mapper = MapperNode(node, drive, page)
        if is_first:
            mapper.say_what_is_not_read(context.obj)
        return mapper

    with (
        _stop_request_once_warm(warm_up) as stop,
        _page(view, "racecar mapper", view_port, tells_places=False) as page,
        ros_node("racecar_mapper", context.obj, partial(ManagedNode, create=partial(create, page))) as node,
    ):
        node.bring_up()
        with stop.looked_for():  # to the end, since only Ctrl-C is to break off what betters the saved map
            try:
                with suppress(KeyboardInterrupt):  # a second one right after the first means the same
                    spin(node, node.survive, stop)
            finally:
                node.end()
            if not drive.mappers:
                return
            try:
                drive.save(node.inform)
            finally:
                if json is not None:
                    write_json(json, {"command": "racecar live map", **node.summary()})
        tell(f"The map is saved. {where_to_look(out, 'map.png', json)}")


live.command(cls=RosCommand)(simulate)


@live.command()
def files() -> None:
    """Print the folder of launch files, commented parameter files, and views for RViz and Foxglove.

    Example: ros2 launch $(racecar live files)/localize.launch.xml map:=$PWD/runs/drive
    """
    from importlib.resources import files as resources

    print(resources("racecar.pipelines.live") / "share")
