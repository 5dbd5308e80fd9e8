"""``racecar demo``: all stages, without any input."""

from pathlib import Path
from typing import Annotated

import typer

from racecar.pipelines.commands.options import SeedOption
from racecar.pipelines.commands.outputs import WritesFolder
from racecar.pipelines.commands.results import EndFlags, where_figures_are

_NAMES = (
    *("mapping_drive.bag", "mapping_drive.ground_truth.tum", "map"),
    *("second_drive.bag", "second_drive.ground_truth.tum", "localized"),
    "report.json",
)


def demo(
    *,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", help="Folder for the results; created if missing."),
        WritesFolder(lambda flags: _NAMES),
    ] = Path("demo"),
    seed: SeedOption = 0,
    ending: EndFlags,
) -> None:
    """Drive a simulated building, map it, find the car on that map, and measure both; takes some minutes.

    Example: racecar demo --out demo
    """
    from racecar.maps.map_files import load_map
    from racecar.pipelines.commands.tables import figure_table, print_tables
    from racecar.pipelines.files.optional_packages import require
    from racecar.pipelines.files.outputs import output_folder, written_to
    from racecar.pipelines.runs.demo_run import run_demo

    require("evo", "The demo")  # before minutes of work
    context = ending.context("racecar demo")
    report, tell = context.report, context.announce
    report.add("inputs", {"world": "building", "seed": seed})
    with output_folder(out) as folder:
        errors = run_demo(load_map(Path("building")), folder, context, seed=seed)
        report.write(folder / "report.json")
    if ending.json is not None:
        report.write(ending.json)
    if ending.quiet:
        return
    rows = []
    for stage, missed in (("mapping", errors.mapping), ("localization", errors.localization)):
        figures = missed.summary()
        position, heading = figures["absolute_position_m"]["mean"], figures["absolute_heading_deg"]["mean"]
        rows.append((stage, f"{position:.4f}", f"{heading:.3f}", f"{missed.matched} of {missed.total}"))
    columns = ("stage", "position (m)", "heading (°)", "poses")
    print_tables(figure_table(columns, rows, title="Mean error against the truth"))
    tell(f"Done in {report.seconds:.0f} s. Open these:")
    tell(f"  {out / 'map' / 'map.png'}  the map, the path driven and the loops closed")
    tell(f"  {out / 'localized' / 'overlay.png'}  scans of the second drive laid over it")
    tell(f"  {out / 'report.json'}  all figures")
    tell(f"Also in {out}: {', '.join(written_to(out))}.")
    if ending.json is not None:
        tell(where_figures_are(ending.json))
