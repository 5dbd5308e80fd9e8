"""``racecar render``: the map of a run is drawn again, as it is wanted."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import ConfigOption, JsonOption, OutputFolderOption, QuietOption
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import DrawingFlags, FileFlags, RunArgument, map_files
from racecar.pipelines.commands.results import print_run, where_to_look

EditsOption = Annotated[
    Path | None,
    typer.Option(
        "--edits",
        metavar="FILE",
        help="Edits to draw over the map, in the frame of DIR; default: edits.yaml in DIR.",
    ),
]


def render(
    *,
    run: RunArgument,
    out: Annotated[OutputFolderOption, WritesFolder(map_files, remakes="run")],
    config: ConfigOption = None,
    drawing: DrawingFlags,
    files: FileFlags,
    edits: EditsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Draw the map of a run again, from its session.npz alone: straight, cropped, finer, as vectors.

    The results are a run of their own, to localize on and to extend; all of its files are in one frame.

    Example: racecar render runs/drive --out runs/straight --turn walls --crop driven --dxf
    """
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.report import Report

    report = Report("racecar render")
    settings = drawing.over(load_config(config).mapping)
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
        requested=files.requested,
    )
    if json is not None:
        report.write(json)
    if quiet:
        return
    figures = report.as_dict()
    width, height = figures["result"]["map_metres"]
    seconds = figures["stages"]["total"]["wall_seconds"]
    done = f"Rendered a map of {width:.0f} × {height:.0f} m in {seconds:.1f} s."
    print_run(report, [done], where_to_look(out, "map.png", json))
