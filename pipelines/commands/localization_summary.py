"""What the terminal shows at the end of a localization run."""

from pathlib import Path

from rich.console import Console

from racecar.localization.verdict.drive_quality import DriveQuality, DriveVerdict
from racecar.pipelines.commands.printed_warnings import print_warnings
from racecar.pipelines.commands.written_files import where_to_look
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.localization_run import LOCALIZATION_FILES

_WORTH_MENDING = 0.02
"""Share of the distance by which the odometry is wrong."""


def print_localization(report: Report, quality: DriveQuality, folder: Path, json: Path | None) -> None:
    """How well the scans fit the map, how fast it went, warnings, where the files are, and the verdict."""
    figures = report.as_dict()
    counts, accuracy, update = figures["counts"], figures["accuracy"], figures["update_ms"]
    share = accuracy["share_of_end_points_within_0.10_m_of_a_wall"] or 0.0
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"{counts['scans']} scans over {counts['path_metres']:.1f} m of path.")
    console.print(f"{share:.0%} of the scans' end points lie within 0.10 m of a wall.")
    if "against_mapping_trajectory" in accuracy:
        error = accuracy["against_mapping_trajectory"]["absolute_position_m"]["mean"]
        console.print(f"The mapping trajectory is {error:.3f} m away on average.")
    if update["mean"] is not None:
        console.print(
            f"A scan took {update['mean']:.1f} ms, 99% of them under {update['percentile_99']:.1f} ms."
        )
    fault = figures.get("odometry_faults", {"distance": 0.0})["distance"]
    # A car that is lost learns nothing true.
    if abs(fault) > _WORTH_MENDING and quality.verdict == DriveVerdict.LOCALIZED:
        console.print(
            f"Odometry reports distances {abs(fault):.0%} too {'short' if fault > 0.0 else 'long'}; the "
            "localizer corrects that. To remedy it, change the gain from motor to speed."
        )
    print_warnings(report.warnings)
    console.print(where_to_look(folder, LOCALIZATION_FILES[0], json), markup=False)
    console.print(quality.summary, markup=False)
