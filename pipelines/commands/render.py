"""``racecar render``: the map of a run is drawn again, as it is wanted."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import ConfigOption, JsonOption, OutputFolderOption, QuietOption
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import (
    CropOption,
    DxfOption,
    FreeOption,
    LeaveOutOption,
    ModeOption,
    OccupiedOption,
    OriginOption,
    PlyOption,
    PngOption,
    ResolutionOption,
    RunArgument,
    SvgOption,
    TurnOption,
    drawn_as,
    map_files,
    requested_files,
)

EditsOption = Annotated[
    Path | None,
    typer.Option(
        "--edits",
        metavar="FILE",
        help="Edits to draw over the map, in the frame of DIR; default: edits.yaml in DIR.",
        show_default=False,
    ),
]


def render(
    run: RunArgument,
    out: Annotated[OutputFolderOption, WritesFolder(map_files, remakes="run")],
    config: ConfigOption = None,
    resolution: ResolutionOption = None,
    turn: TurnOption = None,
    crop: CropOption = None,
    origin: OriginOption = None,
    leave_out: LeaveOutOption = None,
    mode: ModeOption = None,
    occupied: OccupiedOption = None,
    free: FreeOption = None,
    ply: PlyOption = False,
    png: PngOption = False,
    svg: SvgOption = False,
    dxf: DxfOption = False,
    edits: EditsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Draw the map of a run again, from its session.npz alone: straight, cropped, finer, as vectors.

    The results are a run of their own, to localize on and to extend; all of its files are in one frame.

    Example: racecar render runs/drive --out runs/straight --turn walls --crop driven --dxf
    """
    from rich.console import Console

    from racecar.pipelines.commands.printed_warnings import print_warnings
    from racecar.pipelines.commands.written_files import where_to_look
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.report import Report

    report = Report("racecar render")
    settings = drawn_as(
        load_config(config).mapping,
        resolution=resolution,
        turn=turn,
        crop=crop,
        origin=origin,
        leave_out=leave_out,
        mode=mode,
        occupied=occupied,
        free=free,
    )
    with report.stage("loading"):
        from racecar.pipelines.files.edits_file import edits_beside, load_edits
        from racecar.pipelines.runs.render_run import render_into
    render_into(
        out,
        run,
        settings,
        edits_beside(run) if edits is None else load_edits(edits),
        report,
        edits_from=run if edits is None else edits,
        requested=requested_files(ply=ply, png=png, svg=svg, dxf=dxf),
    )
    if json is not None:
        report.write(json)
    if quiet:
        return
    figures = report.as_dict()
    width, height = figures["result"]["map_metres"]
    seconds = figures["stages"]["total"]["wall_seconds"]
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"Rendered a map of {width:.0f} × {height:.0f} m in {seconds:.1f} s.")
    print_warnings(report.warnings)
    console.print(where_to_look(out, "map.png", json), markup=False)
