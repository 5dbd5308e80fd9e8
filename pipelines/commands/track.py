"""``racecar track``: the race track on the map of a run, for racing-line optimizers."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.rendering_options import RunArgument
from racecar.pipelines.commands.results import EndFlags

SpacingOption = Annotated[
    float,
    typer.Option(
        "--spacing", metavar="M", min=0.02, max=10.0, help="Metres between points of the centre line."
    ),
]
SmoothingOption = Annotated[
    float,
    typer.Option(
        "--smoothing", metavar="M", min=0.0, max=10.0, help="Metres over which the centre line is smoothed."
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder for the results; default: DIR."),
    WritesFolder(lambda flags: ("track.csv", "track.png"), remakes=lambda flags: flags["run"]),
]


def track(
    *,
    run: RunArgument,
    out: OutOption = None,
    spacing: SpacingOption = 0.1,
    smoothing: SmoothingOption = 0.5,
    ending: EndFlags,
) -> None:
    """Find the race track on a map: its centre line, how far it is to both sides, and a picture of it.

    The first closed lap that was driven says which way the track goes. Writes track.csv, as TUM's optimizer
    reads it, and track.png.

    Example: racecar track runs/drive
    """
    from racecar.pipelines.files.outputs import output_folder

    context, place = ending.context("racecar track"), run if out is None else out
    with output_folder(place) as folder:
        with context.report.stage("loading"):
            from racecar.pipelines.runs.track_run import find_track, save_track
        found = find_track(run, context, spacing=spacing, smoothing=smoothing)
        save_track(found, context.report, folder, title=run.absolute().name)
    line = found.line
    done = (
        f"The track is {line.length:.1f} m long, and {line.widths.min():.2f} to {line.widths.max():.2f} m "
        "wide."
    )
    ending.end(context.report, [done], place, "track.png")
