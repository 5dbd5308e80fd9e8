"""``racecar render``: draw the map of a run again with other settings."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.floor_plan_options import PlanFlags
from racecar.pipelines.commands.options import ConfigOption, OutputFolderOption
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import DrawingFlags, FileFlags, RunArgument, map_files
from racecar.pipelines.commands.results import EndFlags

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
    out: Annotated[OutputFolderOption, WritesFolder(map_files, remakes=lambda flags: flags["run"])],
    config: ConfigOption = None,
    drawing: DrawingFlags,
    files: FileFlags,
    edits: EditsOption = None,
    plan: PlanFlags,
    ending: EndFlags,
) -> None:
    """Draw the map of a run again, from its session.npz alone: straight, cropped, finer, as vectors.

    The results are a run of their own, to localize on and to extend; all of its files are in one frame.

    Example: racecar render runs/drive --out runs/straight --turn walls --crop driven --dxf
    """
    from racecar.pipelines.files.config_file import load_config

    context = ending.context("racecar render")
    settings, requested = drawing.over(load_config(config).mapping), files.requested
    plan_requested = plan.requested
    with context.report.stage("loading"):
        from racecar.pipelines.runs.render_run import render_run
    drawn = render_run(run, settings, context, edits, plan_requested)
    drawn.save(out, requested, replace=True)
    width, height = drawn.result.tiled.metres
    done = f"Rendered a map of {width:.0f} × {height:.0f} m in {drawn.report.seconds:.1f} s."
    ending.end(drawn.report, [done], out, "map.png", drawn.quality.summary)
