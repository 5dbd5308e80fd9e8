"""``racecar merge``: the maps of several drives become one."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import (
    ConfigOption,
    JsonOption,
    OutputFolderOption,
    QuietOption,
    SeedOption,
)
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import FileFlags, map_files
from racecar.pipelines.commands.results import print_run, where_to_look

RunsArgument = Annotated[
    list[Path], typer.Argument(metavar="DIR...", help="Folders that `racecar map` has written.")
]


def merge(
    *,
    runs: RunsArgument,
    out: Annotated[OutputFolderOption, WritesFolder(map_files)],
    config: ConfigOption = None,
    files: FileFlags,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Join the maps of several drives into one, in any order, from their session.npz alone.

    The map lies in the frame of the longest drive. A drive that fits nowhere is left out and named.

    Example: racecar merge runs/monday runs/tuesday --out runs/both
    """
    from racecar.maps.errors import UserError
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report

    report = Report("racecar merge")
    folders = list(dict.fromkeys(runs))
    if len(folders) < 2:
        raise UserError("There is nothing to merge: name two folders or more that `racecar map` has written.")
    if (out / "trajectory.tum").exists():
        raise UserError(
            f"{out} holds the map of a single drive, with its path: name another folder with --out."
        )
    loaded = load_config(config)
    report.add("inputs", {"runs": [str(folder) for folder in folders], "config": config, "seed": seed})
    with output_folder(out) as folder:
        with report.stage("loading"):
            from racecar.pipelines.runs.edited_folders import refuse_to_lose_edits
            from racecar.pipelines.runs.map_outputs import outputs_with
            from racecar.pipelines.runs.merge_run import draw_merged, merge_runs, save_merged
        outputs_with(files.requested)  # what is missing for them is reported at once
        merged = draw_merged(merge_runs(folders, loaded, seed, report), loaded, report)
        refuse_to_lose_edits(out, merged.edits, folders[0])
        save_merged(merged, loaded, report, folder, requested=files.requested)
    if json is not None:
        report.write(json)
    if quiet:
        return
    figures = report.as_dict()
    width, height = figures["result"]["map_metres"]
    done = f"Merged {figures['counts']['sessions']} maps into one of {width:.0f} × {height:.0f} m."
    print_run(report, [done], where_to_look(out, "map.png", json), merged.quality.summary)
