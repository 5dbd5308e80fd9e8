"""``racecar demo``: all stages, with no input needed."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import JsonOption, QuietOption, SeedOption
from racecar.pipelines.commands.outputs import WritesFolder

_NAMES = (
    *("mapping_drive.bag", "mapping_drive.ground_truth.tum", "map"),
    *("second_drive.bag", "second_drive.ground_truth.tum", "localized"),
    "report.json",
)


def demo(
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", help="Folder for the results; created if missing."),
        WritesFolder(lambda flags: _NAMES),
    ] = Path("demo"),
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Drive a simulated building, map it, find the car on that map, and measure both; takes some minutes.

    Example: racecar demo --out demo
    """
    from rich.console import Console

    from racecar.maps.map_files import load_map
    from racecar.pipelines.commands.tables import demo_table
    from racecar.pipelines.commands.written_files import where_figures_are
    from racecar.pipelines.files.optional_packages import require
    from racecar.pipelines.files.outputs import output_folder, written_to
    from racecar.pipelines.files.report import Report
    from racecar.pipelines.runs.demo_run import run_demo

    require("evo", "The demo")  # before minutes are spent
    console = Console(quiet=quiet, highlight=False, soft_wrap=True)
    report = Report("racecar demo")
    report.add("inputs", {"world": "building", "seed": seed})
    world = load_map(Path("building"))
    with output_folder(out) as folder:
        errors = run_demo(world, folder, report, seed=seed, announce=console.print, quiet=quiet)
        report.write(folder / "report.json")
    if json is not None:
        report.write(json)
    seconds = report.as_dict()["stages"]["total"]["wall_seconds"]
    console.print(demo_table(errors.mapping, errors.localization))
    console.print(f"Done in {seconds:.0f} s. Open these:")
    console.print(f"  {out / 'map' / 'map.png'}  the map, the path driven and the loops closed", markup=False)
    console.print(
        f"  {out / 'localized' / 'overlay.png'}  scans of the second drive laid over it", markup=False
    )
    console.print(f"  {out / 'report.json'}  all figures", markup=False)
    console.print(f"Also in {out}: {', '.join(written_to(out))}.", markup=False)
    if json is not None:
        console.print(where_figures_are(json), markup=False)
