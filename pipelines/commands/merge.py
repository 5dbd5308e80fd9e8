"""``racecar merge``: merge the maps of several drives."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import ConfigOption, OutputFolderOption
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import FileFlags, map_files
from racecar.pipelines.commands.results import EndFlags

RunsArgument = Annotated[
    list[Path], typer.Argument(metavar="DIR...", help="Folders that `racecar map` has written.")
]


def merge(
    *,
    runs: RunsArgument,
    out: Annotated[OutputFolderOption, WritesFolder(map_files)],
    config: ConfigOption = None,
    files: FileFlags,
    ending: EndFlags,
) -> None:
    """Join the maps of several drives into one, in any order, from their session.npz alone.

    The map lies in the frame of the longest drive. A drive that fits nowhere is left out and named.

    Example: racecar merge runs/monday runs/tuesday --out runs/both
    """
    from racecar.maps.errors import UserError
    from racecar.pipelines.files.config_file import load_config

    context = ending.context("racecar merge")
    folders = list(dict.fromkeys(runs))
    if len(folders) < 2:
        raise UserError("There is nothing to merge: name two folders or more that `racecar map` has written.")
    settings, requested = load_config(config), files.requested
    context.report.add("inputs", {"runs": [str(each) for each in folders], "config": config})
    with context.report.stage("loading"):
        from racecar.pipelines.runs.merge_run import merge_runs
    run = merge_runs(folders, settings, context)
    run.save(out, requested, replace=True)
    width, height = run.result.tiled.metres
    joined = context.report.contents.counts.sessions
    done = f"Merged {joined} maps into one of {width:.0f} × {height:.0f} m."
    ending.end(run.report, [done], out, "map.png", run.quality.summary)
