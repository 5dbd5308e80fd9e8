"""What the terminal shows at the end of a mapping run."""

from pathlib import Path

from rich.console import Console

from racecar.mapping.quality.map_quality import MapQuality
from racecar.pipelines.commands.printed_warnings import print_warnings
from racecar.pipelines.commands.written_files import where_to_look
from racecar.pipelines.files.report import Report


def print_mapping(report: Report, quality: MapQuality, folder: Path, json: Path | None) -> None:
    """The size of the work, warnings, where the files are, and what the map is worth."""
    figures = report.as_dict()
    result, seconds = figures["result"], figures["stages"]["total"]["wall_seconds"]
    width, height = result["map_metres"]
    console = Console(highlight=False, soft_wrap=True)
    console.print(
        f"Mapped {figures['counts']['scans']} scans over {result['path_metres']:.1f} m of path "
        f"into a map of {width:.0f} × {height:.0f} m in {seconds:.1f} s."
    )
    print_warnings(report.warnings)
    console.print(where_to_look(folder, "map.png", json), markup=False)
    console.print(quality.summary, markup=False)
