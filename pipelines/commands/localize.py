"""``racecar localize``: localize the car of a bag on a map."""

from collections.abc import Collection
from typing import TYPE_CHECKING, Annotated

import typer

from racecar.pipelines.commands.options import (
    BagArgument,
    ConfigOption,
    MapOption,
    OutputFolderOption,
    ReadingFlags,
    RecordOption,
    SeedOption,
    StartOption,
)
from racecar.pipelines.commands.outputs import Flags, WritesFolder
from racecar.pipelines.commands.results import NOT_GOOD_ENOUGH, EndFlags

if TYPE_CHECKING:
    from racecar.pipelines.files.run_report import RunReport

_WORTH_MENDING = 0.02
"""Relative error of the odometry's distance above which the summary mentions it."""


def _names(flags: Flags) -> Collection[str]:
    """Names of the files written into --out."""
    return ("trajectory.tum", "overlay.png", "report.json", *(["record"] if flags["record"] else []))


def localize(
    *,
    bag: BagArgument,
    map: MapOption,
    out: Annotated[OutputFolderOption, WritesFolder(_names)],
    initial_pose: StartOption = None,
    anywhere: Annotated[
        bool, typer.Option("--global", help="Global localization: the car may start anywhere on the map.")
    ] = False,
    config: ConfigOption = None,
    reading: ReadingFlags,
    record: RecordOption = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit code 3 when the drive is not localized.")
    ] = False,
    seed: SeedOption = 0,
    ending: EndFlags,
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

    context, settings = ending.context("racecar localize"), load_config(config)
    context.report.add("inputs", {"bag": bag, "map": map, "config": config})
    with output_folder(out) as folder, reading.parsed().open(bag, settings.sensors) as reader:
        grid = load_map(map)
        with context.report.stage("loading"):  # after bag and map, so that their faults are reported at once
            from racecar.localization.verdict.drive_quality import DriveVerdict
            from racecar.pipelines.runs.localization_run import run_localization
            from racecar.pipelines.runs.mapping_drive import MappingDrive
        run = run_localization(
            reader,
            grid,
            settings,
            context,
            drive=MappingDrive.beside(map),
            initial_pose=initial_pose,
            anywhere=anywhere,
            seed=seed,
            record_into=folder if record else None,
        )
        run.write(folder)
    is_localized = run.quality.verdict == DriveVerdict.LOCALIZED
    sentences = summary(run.report.contents, is_localized=is_localized)
    ending.end(run.report, sentences, out, "overlay.png", run.quality.summary)
    if strict and not is_localized:
        raise typer.Exit(NOT_GOOD_ENOUGH)


def summary(report: "RunReport", *, is_localized: bool) -> list[str]:
    """The fit of the scans to the map, the speed, and faults of the odometry, in sentences."""
    counts, accuracy, update = report.counts, report.accuracy, report.update_ms
    sentences = [
        f"{counts.scans} scans over {counts.path_metres or 0.0:.1f} m of path.",
        f"{accuracy.share_on_walls or 0.0:.0%} of the scans' end points lie within 0.10 m of a wall.",
    ]
    if (error := accuracy.against_mapping_trajectory.absolute_position_m.mean) is not None:
        sentences.append(f"The mapping trajectory is {error:.3f} m away on average.")
    if update.mean is not None and update.percentile_99 is not None:
        sentences.append(
            f"A scan took {update.mean:.1f} ms, 99% of them under {update.percentile_99:.1f} ms."
        )
    fault = report.odometry_faults.distance
    if abs(fault) > _WORTH_MENDING and is_localized:  # a lost car would learn errors
        sentences.append(
            f"Odometry reports distances {abs(fault):.0%} too {'short' if fault > 0.0 else 'long'}; the "
            "localizer corrects that. To remedy it, change the gain from motor to speed."
        )
    return sentences
