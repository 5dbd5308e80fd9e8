"""``racecar localize``: a bag and a map become the car's poses."""

from collections.abc import Collection
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import (
    BagArgument,
    ConfigOption,
    JsonOption,
    MapOption,
    OutputFolderOption,
    QuietOption,
    ReadingFlags,
    RecordOption,
    SeedOption,
)
from racecar.pipelines.commands.outputs import Flags, WritesFolder
from racecar.pipelines.commands.results import NOT_GOOD_ENOUGH, print_run, where_to_look

if TYPE_CHECKING:
    from racecar.localization.verdict.drive_quality import DriveQuality
    from racecar.pipelines.files.report import Report

_WORTH_MENDING = 0.02
"""Share of the distance by which the odometry is wrong."""


def _names(flags: Flags) -> Collection[str]:
    """Of what is written into --out."""
    return ("trajectory.tum", "overlay.png", "report.json", *(["record"] if flags["record"] else []))


def localize(
    *,
    bag: BagArgument,
    map: MapOption,
    out: Annotated[OutputFolderOption, WritesFolder(_names)],
    initial_pose: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            "--initial-pose",
            metavar="X Y YAW",
            help="Where the car starts, in metres and radians of the map.",
        ),
    ] = None,
    anywhere: Annotated[
        bool, typer.Option("--global", help="Search the whole map for where the car starts.")
    ] = False,
    config: ConfigOption = None,
    reading: ReadingFlags,
    record: RecordOption = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit code 3 when the drive is not localized.")
    ] = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Estimate where the car was on a map: trajectory.tum, overlay.png and report.json.

    Without --initial-pose and --global the bag that made the map starts where it was then, by the map's
    report.json and trajectory.tum; any other starts anywhere.

    When the map turns out to be of another place, the search stops.

    Example: racecar localize drive.bag --map runs/drive --out runs/localized
    """
    from racecar.maps.map_files import load_map
    from racecar.pipelines.files.config_file import load_config
    from racecar.pipelines.files.outputs import output_folder
    from racecar.pipelines.files.report import Report

    report = Report("racecar localize")
    loaded = load_config(config)
    report.add("inputs", {"bag": bag, "map": map, "config": config})
    with output_folder(out) as folder, reading.parsed().open(bag, loaded.sensors) as reader:
        grid = load_map(map)
        with report.stage("loading"):  # after bag and map, so that their faults are reported at once
            from racecar.localization.verdict.drive_quality import DriveVerdict
            from racecar.pipelines.runs.localized_bag import localize_reader
        localized = localize_reader(
            reader,
            grid,
            loaded,
            report,
            map_path=map,
            initial_pose=initial_pose,
            anywhere=anywhere,
            seed=seed,
            quiet=quiet,
            record_into=folder if record else None,
        )
        localized.write(folder)
    if json is not None:
        report.write(json)
    quality = localized.quality
    if not quiet:
        sentences = summary(report, quality)
        print_run(report, sentences, where_to_look(out, "overlay.png", json), quality.summary)
    if strict and quality.verdict != DriveVerdict.LOCALIZED:
        raise typer.Exit(NOT_GOOD_ENOUGH)


def summary(report: "Report", quality: "DriveQuality") -> list[str]:
    """How well the scans fit the map, how fast it went, and what is wrong with the odometry, in sentences."""
    from racecar.localization.verdict.drive_quality import DriveVerdict

    figures = report.as_dict()
    counts, accuracy, update = figures["counts"], figures["accuracy"], figures["update_ms"]
    share = accuracy["share_of_end_points_within_0.10_m_of_a_wall"] or 0.0
    sentences = [
        f"{counts['scans']} scans over {counts['path_metres']:.1f} m of path.",
        f"{share:.0%} of the scans' end points lie within 0.10 m of a wall.",
    ]
    if "against_mapping_trajectory" in accuracy:
        error = accuracy["against_mapping_trajectory"]["absolute_position_m"]["mean"]
        sentences.append(f"The mapping trajectory is {error:.3f} m away on average.")
    if update["mean"] is not None:
        sentences.append(
            f"A scan took {update['mean']:.1f} ms, 99% of them under {update['percentile_99']:.1f} ms."
        )
    fault = figures.get("odometry_faults", {"distance": 0.0})["distance"]
    # A car that is lost learns nothing true.
    if abs(fault) > _WORTH_MENDING and quality.verdict == DriveVerdict.LOCALIZED:
        sentences.append(
            f"Odometry reports distances {abs(fault):.0%} too {'short' if fault > 0.0 else 'long'}; the "
            "localizer corrects that. To remedy it, change the gain from motor to speed."
        )
    return sentences
